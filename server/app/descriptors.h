// The file descriptors that the process may have: connections, the files of worlds, and what libraries open.
#pragma once

#include <cstddef>

namespace pneuma::app {

/// Takes as many as the system lets the process have; how many those are.
std::size_t raise_descriptor_limit();

}  // namespace pneuma::app
