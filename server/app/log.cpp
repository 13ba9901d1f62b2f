#include "app/log.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <thread>
#include <utility>

#include <boost/json/serialize.hpp>
#include <boost/json/string.hpp>
#include <spdlog/async.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include "app/limited_sink.h"
#include "base/limits.h"
#include "scene_io/quoted.h"

namespace pneuma::app {

namespace {

constexpr std::chrono::seconds flush_patience{1};
constexpr std::chrono::milliseconds flush_look{1};

/// "%j": the text of a line, as a JSON string.
class JsonText final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/, spdlog::memory_buf_t& out) override {
    const std::string text =
        boost::json::serialize(boost::json::string_view(message.payload.data(), message.payload.size()));
    out.append(text.data(), text.data() + text.size());
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<JsonText>(); }
};

std::unique_ptr<spdlog::formatter> formatter_of(LogForm form) {
  constexpr const char* time = "%Y-%m-%dT%H:%M:%S.%e%z";
  if (form == LogForm::text) return std::make_unique<spdlog::pattern_formatter>(std::string(time) + " %l %v");
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<JsonText>('j').set_pattern(std::string("{\"time\":\"") + time +
                                                 "\",\"level\":\"%l\",\"text\":%j}");
  return formatter;
}

}  // namespace

void start_log(const std::string& level, LogForm form) {
  auto sink = std::make_shared<LimitedSink>(std::make_shared<spdlog::sinks::stderr_sink_mt>());
  sink->set_formatter(formatter_of(form));
  spdlog::init_thread_pool(base::log_lines_waiting_max, 1);
  auto logger = std::make_shared<spdlog::async_logger>("pneuma", std::move(sink), spdlog::thread_pool(),
                                                       spdlog::async_overflow_policy::overrun_oldest);
  spdlog::set_default_logger(std::move(logger));
  spdlog::set_level(spdlog::level::from_str(level));
}

// A line that was taken from the queue may still be on its way: the flush behind it is taken after it.
bool flush_log() {
  spdlog::default_logger()->flush();
  const auto deadline = std::chrono::steady_clock::now() + flush_patience;
  while (spdlog::thread_pool()->queue_size() > 0) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(flush_look);
  }
  return true;
}

std::string toggle_debug_log(const std::string& usual_level) {
  const std::string level = spdlog::get_level() == spdlog::level::debug ? usual_level : "debug";
  spdlog::set_level(spdlog::level::from_str(level));
  return level;
}

std::uint64_t log_lines_dropped() {
  std::uint64_t dropped = 0;
  for (const spdlog::sink_ptr& sink : spdlog::default_logger()->sinks()) {
    if (const auto* limited = dynamic_cast<const LimitedSink*>(sink.get())) dropped += limited->dropped();
  }
  if (const auto thread = spdlog::thread_pool()) dropped += thread->overrun_counter();
  return dropped;
}

std::string log_name(std::string_view name) {
  const bool is_plain = !name.empty() && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
           c == '-';
  });
  if (is_plain) return std::string(name);
  // What would end the quotes, or seem to escape something, is no part of it.
  std::string text(name);
  std::ranges::replace(text, '"', '\'');
  std::ranges::replace(text, '\\', '/');
  return '"' + scene_io::escaped(text, base::name_bytes_max) + '"';
}

}  // namespace pneuma::app
