// Limits of tokens and of who says them, with their reasons (limits.h has others).
#pragma once

#include <chrono>
#include <cstddef>

namespace pneuma::base {

// Of the file of tokens: one for everybody in a large house. A line takes some 120 bytes.
inline constexpr std::size_t tokens_max = 4'096;
inline constexpr std::size_t token_file_bytes_max = 1024 * 1024;
// A century: longer is never.
inline constexpr std::chrono::days token_life_max{36'525};

// Wrong tokens of one address, before it has to wait: somebody who mistypes.
inline constexpr std::size_t token_guesses_at_once = 5;
// Then after each one more, twice as long as before: a guess a minute is no way to find a token of eight letters.
inline constexpr std::chrono::seconds token_guess_wait_min{1};
inline constexpr std::chrono::seconds token_guess_wait_max{60};
inline constexpr std::chrono::minutes token_guesses_forgotten_after{60};
// A program that was given a wrong token says it again and again, which is no guess.
inline constexpr std::size_t token_guesses_remembered = 8;
inline constexpr std::size_t token_guessers_max = 4'096;
// A token as long as this is taken for a random one, which no number of guesses finds: who has it gets in, whatever
// others at the same address say.
inline constexpr std::size_t token_unguessable_characters = 32;

// Kept for who asks when there are no descriptors left: what one address may be refused at a time, twice.
inline constexpr std::size_t spare_descriptors = 16;

}  // namespace pneuma::base
