// How a list of parts says that one does not apply.
#pragma once

#include <string_view>

namespace pneuma::physics {

/// In the place of the part, so that one which was forgotten does not compile.
struct None {
  std::string_view why;
};

}  // namespace pneuma::physics
