// Characters that do not show as themselves.
#pragma once

#include <cstddef>
#include <string_view>

namespace pneuma::base {

/// How many bytes, from byte `i` of a text in UTF-8 on, are of a character that does not show as itself: a control, or
/// one that is not seen, ends a line or turns the text around it. 0: it shows.
[[nodiscard]] std::size_t hidden_bytes(std::string_view text, std::size_t i);

/// Whether any character of it does not show as itself.
[[nodiscard]] bool has_hidden(std::string_view text);

}  // namespace pneuma::base
