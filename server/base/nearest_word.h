// "did you mean ...": the known word nearest to one that is not known.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace pneuma::base {

/// The candidate that a slip of the keyboard could have meant; empty where none is that near.
[[nodiscard]] std::string nearest_word(std::string_view word, std::span<const std::string> candidates);

/// "; did you mean CANDIDATE?", to stand behind what is wrong; empty likewise.
[[nodiscard]] std::string did_you_mean(std::string_view word, std::span<const std::string> candidates);

}  // namespace pneuma::base
