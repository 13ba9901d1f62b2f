// How a failure of the `pneuma` command is worded for people.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

#include "base/status.h"

namespace pneuma::client {

/// One line that leads with words: "FILE: what", and of a server's error "what (pause.world)", with the wire's path
/// last.
[[nodiscard]] std::string told(const base::Status& status);

/// An error of a text that a request brought, by the place in the user's file; `field` is the text's path on the wire.
[[nodiscard]] base::Status in_users_file(const base::Status& status, const std::string& field, const std::string& file);

/// The same failure with the nearest of the words behind it, or with all of them where none is near.
[[nodiscard]] base::Status with_suggestion(const base::Status& status, std::string_view word,
                                           std::span<const std::string> words);

/// What is wrong with the command line, with the nearest subcommand or flag where one is not known.
[[nodiscard]] base::Status usage_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace pneuma::client
