// The page's address as a browser takes it.
#pragma once

#include <string>

#include "base/status.h"

namespace pneuma::base {

/// Where HTTP is when nobody says otherwise: the port after that of `address`, a HOST:PORT, as with 7420 and 7421. Of
/// port 0, which picks any, port 0.
[[nodiscard]] Result<std::string> http_beside(const std::string& address);

/// "http://127.0.0.1:7421" of the HTTP address HOST:PORT, https with TLS. Of a server that listens at every address it
/// is the link on the server's own machine. Empty where there is no HTTP address ("off").
[[nodiscard]] std::string page_link(const std::string& http_address, bool tls);

/// The line by which a server says that it listens: "ready tcp=HOST:PORT http=HOST:PORT", and " page=LINK" where it
/// shows one.
[[nodiscard]] std::string ready_line(const std::string& tcp_address, const std::string& http_address,
                                     const std::string& link);

}  // namespace pneuma::base
