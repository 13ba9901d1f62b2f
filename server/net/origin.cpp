#include "net/origin.h"

#include <algorithm>
#include <string>
#include <utility>

#include <boost/asio/ip/address_v4.hpp>
#include <boost/asio/ip/address_v6.hpp>

namespace pneuma::net {

namespace {

struct Authority {
  std::string host;
  std::string port;
  bool operator==(const Authority&) const = default;
};

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(),
                         [](char c) { return 'A' <= c && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return out;
}

Authority split(std::string_view authority, std::string_view default_port) {
  const std::size_t colon = authority.rfind(':');
  const std::size_t bracket = authority.rfind(']');  // of an IPv6 address, whose own colons come before it
  const bool has_port = colon != std::string_view::npos && (bracket == std::string_view::npos || colon > bracket);
  return {lower(authority.substr(0, has_port ? colon : authority.size())),
          std::string(has_port ? authority.substr(colon + 1) : default_port)};
}

bool is_loopback(std::string_view host) {
  return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

/// Of IPv4 in dotted form, or of IPv6 in brackets.
bool is_address(const std::string& host) {
  boost::system::error_code error;
  if (host.starts_with('[') && host.ends_with(']')) {
    (void)boost::asio::ip::make_address_v6(host.substr(1, host.size() - 2), error);
  } else {
    (void)boost::asio::ip::make_address_v4(host, error);
  }
  return !error;
}

}  // namespace

bool is_same_origin(std::string_view origin, std::string_view host) {
  constexpr std::string_view separator = "://";
  const std::size_t scheme_end = origin.find(separator);
  if (scheme_end == std::string_view::npos || host.empty()) return false;  // "null": a page without an origin
  const std::string_view default_port = lower(origin.substr(0, scheme_end)) == "https" ? "443" : "80";
  const Authority from = split(origin.substr(scheme_end + separator.size()), default_port);
  const Authority to = split(host, default_port);
  return from == to || (from.port == to.port && is_loopback(from.host) && is_loopback(to.host));
}

AllowedHosts::AllowedHosts(std::vector<std::string> names) : names_(std::move(names)) {
  for (std::string& name : names_) name = lower(name);
}

bool AllowedHosts::allow(std::string_view host) const {
  const std::string name = split(host, {}).host;
  if (name.empty()) return false;
  return name == "localhost" || is_address(name) ||
         std::ranges::any_of(names_, [&](const std::string& known) { return known == "*" || known == name; });
}

}  // namespace pneuma::net
