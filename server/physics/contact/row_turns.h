// The order in which a sweep answers rows between lumped masses.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/row.h"
#include "physics/contact/surface_body.h"

namespace pneuma::physics {

/// Sorts rows so that those that follow each other seldom share a vertex: a processor then works on several at once.
class RowTurns {
 public:
  void sort(std::vector<ContactRow>& rows, std::span<const SurfaceBody> bodies);

  [[nodiscard]] std::size_t bytes() const;

 private:
  std::vector<std::vector<std::uint64_t>> taken_;  // one a vertex of each body: a bit a turn
  std::vector<std::uint32_t> turn_of_;             // one a row
  std::vector<ContactRow> sorted_;
};

}  // namespace pneuma::physics
