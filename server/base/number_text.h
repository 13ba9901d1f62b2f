// Numbers in messages to people.
#pragma once

#include <string>

namespace pneuma::base {

/// The number in as few characters as nine digits need: "1000", "0.5", "1e+07".
[[nodiscard]] std::string number_text(double value);

}  // namespace pneuma::base
