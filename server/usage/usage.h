// What a program's command table says beside --help: completion for shells, the manual page, and what a wrong word may
// have meant. All are made from the same CLI::App, so that none can say anything else.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace pneuma::usage {

/// Adds --completion bash|zsh|fish and --manual: they print, and the program ends. After all other flags and
/// subcommands; what is added later is not in them.
void add_generators(CLI::App& app);

[[nodiscard]] std::string bash_completion(const CLI::App& app);
[[nodiscard]] std::string zsh_completion(const CLI::App& app);
[[nodiscard]] std::string fish_completion(const CLI::App& app);
/// What is wrong with a command line, in one line: with the nearest subcommand or flag where one is not known.
[[nodiscard]] std::string usage_error(const CLI::App& app, const CLI::ParseError& error);
/// A page of section 1, in the man macros.
[[nodiscard]] std::string manual_page(const CLI::App& app);

}  // namespace pneuma::usage
