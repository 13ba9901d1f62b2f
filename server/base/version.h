#pragma once

#include <string_view>

namespace pneuma::base {

/// The version of the product, "MAJOR.MINOR.PATCH", set once in the top CMakeLists.txt.
inline constexpr std::string_view version = PNEUMA_VERSION;

}  // namespace pneuma::base
