// "did you mean ...": the known word nearest to one that is not known.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace pneuma::base {

/// The candidate that was meant: one that a slip of the keyboard made of the word, that begins with it, or that holds
/// it; empty where there is none. Takes a bounded time however many candidates there are.
[[nodiscard]] std::string nearest_word(std::string_view word, std::span<const std::string> candidates);

/// "; did you mean CANDIDATE?", to stand behind what is wrong; empty likewise.
[[nodiscard]] std::string did_you_mean(std::string_view word, std::span<const std::string> candidates);

/// The same, and where none is near "; there are A, B, ...": the first of the candidates, some 200 bytes of them.
[[nodiscard]] std::string nearest_or_all(std::string_view word, std::span<const std::string> candidates);

}  // namespace pneuma::base
