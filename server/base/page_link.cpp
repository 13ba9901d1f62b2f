#include "base/page_link.h"

#include "base/address.h"

namespace pneuma::base {

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
