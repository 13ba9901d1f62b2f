// Whether a sanitizer watches the libraries under test. The tests' own code is compiled without the address sanitizer.
#pragma once

#include <string_view>

#ifndef PNEUMA_SANITIZER
#define PNEUMA_SANITIZER ""
#endif

namespace pneuma::support {

inline constexpr bool is_address_sanitized = std::string_view(PNEUMA_SANITIZER) == "address";
inline constexpr bool is_thread_sanitized = std::string_view(PNEUMA_SANITIZER) == "thread";
inline constexpr bool is_sanitized = is_address_sanitized || is_thread_sanitized;

}  // namespace pneuma::support
