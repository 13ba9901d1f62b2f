// The server's log: written by a thread of its own, so that nobody waits for who reads it; no line that a client can
// forge, and none over and over.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace pneuma::app {

enum class LogForm { text, json };

/// Writes to standard error from now on, what is of `level` (spdlog's names) and above.
void start_log(const std::string& level, LogForm form = LogForm::text);
/// Waits until all lines so far are written, for a second at most: whoever reads them may have stopped. True where they
/// are; where they are not, the process can end only without the log's thread (std::_Exit).
bool flush_log();
/// Logs debug lines too, or no more; the level that is logged now.
std::string toggle_debug_log(const std::string& usual_level);
/// Lines that found no room, or were the same as too many before them.
[[nodiscard]] std::uint64_t log_lines_dropped();

/// A name from outside, for a line of the log: as it is where it has letters, digits, '.', '_' and '-' alone; else in
/// quotes, with what is no plain character escaped.
[[nodiscard]] std::string log_name(std::string_view name);

}  // namespace pneuma::app
