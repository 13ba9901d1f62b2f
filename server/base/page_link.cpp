#include "base/page_link.h"

#include <cstdlib>

#include "base/address.h"

namespace pneuma::base {

Result<std::string> http_beside(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  const unsigned long port = std::strtoul(address.c_str() + colon + 1, nullptr, 10);
  if (port >= 65'535) return invalid("no port follows that of the server; give --http HOST:PORT", address);
  return address.substr(0, colon + 1) + std::to_string(port == 0 ? 0 : port + 1);
}

std::string page_link(const std::string& http_address, bool tls) {
  const auto parsed = parse_address(http_address);
  if (!parsed.ok()) return {};
  const std::string scheme = tls ? "https://" : "http://";
  if (parsed->host == "0.0.0.0" || parsed->host == "::") return scheme + "localhost:" + parsed->port;
  return scheme + http_address;
}

std::string ready_line(const std::string& tcp_address, const std::string& http_address, const std::string& link) {
  const std::string line = "ready tcp=" + tcp_address + " http=" + http_address;
  return link.empty() ? line : line + " page=" + link;
}

}  // namespace pneuma::base
