// A sink of the log that lets the same line through ten times a minute, and then says how often it came.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include <spdlog/sinks/base_sink.h>

namespace pneuma::app {

/// Lines count as the same where they differ only in what clients can choose: numbers, values behind '=', and what
/// stands in quotes. Debug lines are not limited. A flush tells what was dropped so far.
class LimitedSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  using Clock = spdlog::log_clock;
  static constexpr int lines_per_minute = 10;

  explicit LimitedSink(std::shared_ptr<spdlog::sinks::sink> to) : to_(std::move(to)) {}

  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override;
  void set_pattern_(const std::string& pattern) override { to_->set_pattern(pattern); }
  void set_formatter_(std::unique_ptr<spdlog::formatter> formatter) override {
    to_->set_formatter(std::move(formatter));
  }

 private:
  struct Kind {
    Clock::time_point since{};  // the minute that is counted
    int lines = 0;
    std::uint64_t dropped = 0;
    spdlog::level::level_enum level = spdlog::level::info;
  };
  /// Tells what was dropped of kinds that are counted for so long, and begins anew with those whose minute is over.
  void tell_dropped(Clock::time_point now, Clock::duration age);
  void pass_on(const spdlog::details::log_msg& like, std::string_view text);

  std::shared_ptr<spdlog::sinks::sink> to_;
  std::map<std::string, Kind> kinds_;
  Clock::time_point next_look_{};
  std::atomic<std::uint64_t> dropped_ = 0;
};

/// What of a line is the same in lines that count as the same.
[[nodiscard]] std::string kind_of_line(std::string_view line);

}  // namespace pneuma::app
