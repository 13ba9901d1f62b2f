// What whoever runs a test asks of it.
#pragma once

#include <cstdint>
#include <cstdlib>

namespace pneuma::support {

/// The number in an environment variable.
[[nodiscard]] inline std::uint64_t number_from_environment(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

}  // namespace pneuma::support
