// Who may speak: one shared token, read from a file.
#pragma once

#include <string>
#include <string_view>

#include "base/status.h"

namespace pneuma::app {

/// The first line of `file`, without the line end. Refuses a file that cannot be read or holds no token.
[[nodiscard]] base::Result<std::string> read_token(const std::string& file);

/// True where others than the owner and the group may read `file`.
[[nodiscard]] bool is_world_readable(const std::string& file);

/// Takes the same time wherever the two differ.
[[nodiscard]] bool same_token(std::string_view given, std::string_view expected);

}  // namespace pneuma::app
