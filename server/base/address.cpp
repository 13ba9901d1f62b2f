#include "base/address.h"

namespace pneuma::base {

Result<Address> parse_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == text.size()) return invalid("not HOST:PORT", text);
  Address address{text.substr(0, colon), text.substr(colon + 1)};
  const bool is_v6 = address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']';
  if (is_v6) address.host = address.host.substr(1, address.host.size() - 2);
  const bool is_number = address.port.size() <= 5 && address.port.find_first_not_of("0123456789") == std::string::npos;
  if (!is_number || std::stoul(address.port) > 65'535) return invalid("the port is no number up to 65535", text);
  return address;
}

}  // namespace pneuma::base
