// Groups: bodies that rows tie together. Each is solved by itself.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/row.h"

namespace pneuma::physics {

/// A run of rows of one group, after group_rows().
struct RowGroup {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Sorts the rows by group, and by key within each, and lists the runs. `yields[body]`: 0 of those that do not give
/// way, which tie nothing together.
void group_rows(std::vector<ContactRow>& rows, std::span<const std::uint8_t> yields, std::vector<RowGroup>& groups);

}  // namespace pneuma::physics
