// Asks a running server whether it is well; for the container's health check.
#pragma once

#include <string>

#include "base/status.h"

namespace pneuma::app {

/// GETs /healthz at HOST:PORT, over TLS where `tls` is set (whoever answers is believed: it is this machine's own
/// server). OK for a 200 within five seconds; otherwise what came instead.
[[nodiscard]] base::Status probe_health(const std::string& address, bool tls);

}  // namespace pneuma::app
