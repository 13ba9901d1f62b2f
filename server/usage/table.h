// A CLI::App as the generators of this folder read it.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace pneuma::usage {

[[nodiscard]] std::vector<const CLI::App*> subcommands_of(const CLI::App& app);
/// Without positional arguments, and without what help does not show.
[[nodiscard]] std::vector<const CLI::Option*> flags_of(const CLI::App& app);
[[nodiscard]] std::vector<const CLI::Option*> arguments_of(const CLI::App& app);
[[nodiscard]] bool takes_value(const CLI::Option& option);
/// "--format"; every flag of ours has a long name.
[[nodiscard]] std::string long_name(const CLI::Option& option);
/// The values that it takes, where they are few and named.
[[nodiscard]] std::vector<std::string> choices_of(const CLI::Option& option);
/// What a value is called, in capitals as --help has it: "FLOAT", "NAME".
[[nodiscard]] std::string value_name(const CLI::Option& option);

}  // namespace pneuma::usage
