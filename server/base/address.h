// HOST:PORT or [V6]:PORT, as flags give them.
#pragma once

#include <string>

#include "base/status.h"

namespace pneuma::base {

struct Address {
  std::string host;  // of V6 without its brackets
  std::string port;  // 0 to 65535
};

/// Errors name the text and what it lacks.
[[nodiscard]] Result<Address> parse_address(const std::string& text);

}  // namespace pneuma::base
