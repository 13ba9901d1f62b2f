// Groups: bodies that rows tie together. Each is solved by itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/row.h"

namespace pneuma::physics {

/// Finds which bodies are one group, from pairs that are.
class JoinedBodies {
 public:
  void begin(std::size_t count);
  void join(std::uint32_t a, std::uint32_t b);
  /// The lowest body of its group, whatever the order in which they were joined.
  [[nodiscard]] std::uint32_t lowest_with(std::uint32_t body);

  [[nodiscard]] std::size_t bytes() const { return parent_.capacity() * sizeof(std::uint32_t); }

 private:
  std::vector<std::uint32_t> parent_;  // one a body: itself, or a lower one of its group
};

/// A run of rows of one group, after group_rows().
struct RowGroup {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Sorts the rows by group, and by key within each, and lists the runs. `yields[body]`: 0 of those that do not give
/// way, which tie nothing together.
void group_rows(std::vector<ContactRow>& rows, std::span<const std::uint8_t> yields, std::vector<RowGroup>& groups);

}  // namespace pneuma::physics
