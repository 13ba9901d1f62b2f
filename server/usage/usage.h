// What a program's command table says beside --help: completion for shells, and the manual page. Both are made from the
// same CLI::App, so that neither can say anything else.
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
/// A page of section 1, in the man macros.
[[nodiscard]] std::string manual_page(const CLI::App& app);

}  // namespace pneuma::usage
