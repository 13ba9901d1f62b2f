// Tokens as text: read from a file or a header, and compared without telling where they differ.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "base/status.h"

namespace pneuma::app {

/// The first line of `file`, without the line end. Refuses a file that cannot be read or holds no token.
[[nodiscard]] base::Result<std::string> read_token(const std::string& file);

/// True where others than the owner and the group may read `file`.
[[nodiscard]] bool is_world_readable(const std::string& file);

/// SHA-256: enough for tokens of 256 random bits, which nobody can try through.
using TokenDigest = std::array<unsigned char, 32>;
[[nodiscard]] TokenDigest digest_of(std::string_view token);
/// Takes the same time wherever the two differ.
[[nodiscard]] bool same_digest(const TokenDigest& a, const TokenDigest& b);

/// The token in an Authorization header of HTTP, "Bearer TOKEN"; nothing where there is none.
[[nodiscard]] std::optional<std::string_view> bearer_token(std::string_view authorization);

}  // namespace pneuma::app
