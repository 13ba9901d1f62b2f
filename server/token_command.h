// `pneuma-server token new|list|revoke`: keeps the file of --tokens.
#pragma once

#include <functional>

#include <CLI/CLI.hpp>

#include "base/status.h"

namespace pneuma {

/// Adds the commands to `app`. One that was parsed sets `work`, which does it.
void add_token_commands(CLI::App& app, std::function<base::Status()>& work);

}  // namespace pneuma
