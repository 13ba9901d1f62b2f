// Characters that do not show as themselves.
#pragma once

#include <cstddef>
#include <string_view>

namespace pneuma::base {

/// The length in bytes of the character at byte `i` of a text in UTF-8, where it does not show as itself; else 0. Such
/// are controls, and what is not seen, ends a line or turns the text around it.
[[nodiscard]] std::size_t hidden_bytes(std::string_view text, std::size_t i);

/// Whether any character of it does not show as itself.
[[nodiscard]] bool has_hidden(std::string_view text);

}  // namespace pneuma::base
