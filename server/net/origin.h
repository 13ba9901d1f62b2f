// Whether a page in a browser may open a WebSocket here.
#pragma once

#include <string_view>

namespace pneuma::net {

/// A page from elsewhere, open in somebody's browser, must not drive a server in reach of that browser. `origin` and
/// `host` are the request's header fields; true where they name the same host and port, or two loopback names and the
/// same port.
[[nodiscard]] bool is_same_origin(std::string_view origin, std::string_view host);

}  // namespace pneuma::net
