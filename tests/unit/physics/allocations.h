// Counts what the tests of this program allocate.
#pragma once

#include <cstddef>

namespace pneuma::physics {

/// Calls of operator new so far, by any thread.
[[nodiscard]] std::size_t allocations();

}  // namespace pneuma::physics
