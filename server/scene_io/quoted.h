// Text from outside, made fit for one line of an error.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace pneuma::scene_io {

inline constexpr std::size_t shown_word_bytes_max = 40;
inline constexpr std::size_t shown_path_bytes_max = 200;

/// At most its first bytes_max bytes, cut between characters; the bytes of characters that do not show as themselves
/// (controls, those that turn the text around them) as \xNN.
[[nodiscard]] std::string escaped(std::string_view text, std::size_t bytes_max = shown_word_bytes_max);

/// A word, escaped, in quotes. (Not `quoted`: std::quoted would be found for a std::string.)
[[nodiscard]] std::string in_quotes(std::string_view text);

/// Adds a name to a list of names that an error offers, "a, b"; past a few hundred bytes "..." ends it.
void append_name(std::string& list, std::string_view name);

}  // namespace pneuma::scene_io
