// Whether a page in a browser may open a WebSocket here, and by which names this server may be asked.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace pneuma::net {

/// A page from elsewhere, open in somebody's browser, must not drive a server in reach of that browser. `origin` and
/// `host` are the request's header fields; true where they name the same host and port, or two loopback names and the
/// same port.
[[nodiscard]] bool is_same_origin(std::string_view origin, std::string_view host);

/// The names in a Host header that are this server's. A page from elsewhere may have its own name point here once it is
/// loaded (DNS rebinding), and is of the same origin then; so no names are taken but those that are known. Addresses
/// and localhost always are: nobody else can have a page at them.
class AllowedHosts {
 public:
  /// "*" stands for any name.
  explicit AllowedHosts(std::vector<std::string> names = {});

  /// `host` is the header's field, a port with it or not.
  [[nodiscard]] bool allow(std::string_view host) const;

 private:
  std::vector<std::string> names_;  // in lower case
};

}  // namespace pneuma::net
