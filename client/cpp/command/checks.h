// What a flag of the `pneuma` command must be, checked as it is read.
#pragma once

#include <cstddef>

#include <CLI/CLI.hpp>

namespace pneuma::client {

[[nodiscard]] CLI::Validator address_check();
/// From 0 to 1e9: a clock takes them.
[[nodiscard]] CLI::Validator seconds_check();
/// A tick or an event, as parse_awaited takes it.
[[nodiscard]] CLI::Validator awaited_check();
[[nodiscard]] CLI::Validator positive_check();
[[nodiscard]] CLI::Validator not_negative_check();
/// `N` numbers with commas between them.
template <std::size_t N>
[[nodiscard]] CLI::Validator numbers_check();
extern template CLI::Validator numbers_check<3>();
extern template CLI::Validator numbers_check<6>();

}  // namespace pneuma::client
