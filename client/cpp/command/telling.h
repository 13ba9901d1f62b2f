// What the `pneuma` command says on standard error: failures, and what came out otherwise than it was asked for.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "base/status.h"
#include "command/commands.h"

namespace pneuma::client {

/// One line that leads with words: "FILE: what", and of a server's error "what (pause.world)", with the wire's path
/// last.
[[nodiscard]] std::string told(const base::Status& status);

/// An error of a text that a request brought, by the place in the user's file; `field` is the text's path on the wire.
[[nodiscard]] base::Status in_users_file(const base::Status& status, const std::string& field, const std::string& file);

/// The same failure with the nearest of the words behind it, or with all of them where none is near.
[[nodiscard]] base::Status with_suggestion(const base::Status& status, std::string_view word,
                                           std::span<const std::string> words);

/// One line on standard error, "pneuma: text", or an object for scripts.
void note(const Session& session, const std::string& text);

/// Where the server rounded what was asked of a stream.
void note_rounding(const Session& session, const SubscribeOptions& asked, const v1::Subscribed& got);

/// Where a world that was given no name has one with a number behind it, because another has the name itself.
void note_new_name(Session& session, const std::string& world);

}  // namespace pneuma::client
