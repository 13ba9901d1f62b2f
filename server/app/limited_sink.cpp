#include "app/limited_sink.h"

#include <algorithm>
#include <iterator>
#include <limits>

#include "scene_io/quoted.h"

namespace pneuma::app {

namespace {

constexpr std::chrono::minutes window{1};
constexpr std::chrono::seconds look_interval{1};
// Kinds in a minute; what comes past them counts as one kind. The server's own code has fewer.
constexpr std::size_t kinds_max = 256;
constexpr std::string_view other_kinds = "lines of many kinds";

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

}  // namespace

std::string kind_of_line(std::string_view line) {
  std::string kind;
  bool in_quotes = false;
  bool in_value = false;  // behind a '='
  for (const char c : line) {
    if (c == '"') in_quotes = !in_quotes;
    if (in_quotes || c == '"') continue;
    if (c == ' ') in_value = false;
    if (in_value || is_digit(c)) continue;
    kind += c;
    in_value = c == '=';
  }
  return kind;
}

void LimitedSink::sink_it_(const spdlog::details::log_msg& message) {
  if (message.time >= next_look_) tell_dropped(message.time, window);
  const std::string_view text(message.payload.data(), message.payload.size());
  if (message.level < spdlog::level::info) return pass_on(message, text);
  std::string key = kind_of_line(text);
  if (!kinds_.contains(key) && kinds_.size() >= kinds_max) key = other_kinds;
  Kind& kind = kinds_[key];
  if (kind.lines == 0) kind.since = message.time;
  kind.level = std::max(kind.level, message.level);
  if (kind.lines >= lines_per_minute) {
    ++kind.dropped;
    ++dropped_;
    return;
  }
  ++kind.lines;
  pass_on(message, text);
}

void LimitedSink::flush_() {
  tell_dropped(Clock::now(), std::chrono::seconds(0));
  to_->flush();
}

void LimitedSink::tell_dropped(Clock::time_point now, Clock::duration age) {
  next_look_ = now + look_interval;
  for (auto entry = kinds_.begin(); entry != kinds_.end();) {
    auto& [key, kind] = *entry;
    if (now >= kind.since + age && kind.dropped > 0) {
      pass_on({now, {}, {}, kind.level, {}}, "dropped_lines=" + std::to_string(kind.dropped) + " like: " + key);
      kind.dropped = 0;
    }
    entry = now >= kind.since + window ? kinds_.erase(entry) : std::next(entry);
  }
}

// Whatever text from outside is in a line, it stays one line and shows as it is.
void LimitedSink::pass_on(const spdlog::details::log_msg& like, std::string_view text) {
  const std::string escaped = scene_io::escaped(text, std::numeric_limits<std::size_t>::max());
  spdlog::details::log_msg message = like;
  message.payload = spdlog::string_view_t(escaped.data(), escaped.size());
  to_->log(message);
}

}  // namespace pneuma::app
