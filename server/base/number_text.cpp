#include "base/number_text.h"

#include <array>
#include <cstdio>

namespace pneuma::base {

std::string number_text(double value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.9g", value);
  return buffer.data();
}

}  // namespace pneuma::base
