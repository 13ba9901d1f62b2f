// Shows which lines of the log come through, at times that the test makes up, and that each is one line whatever it
// says.
#include "app/limited_sink.h"

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <spdlog/details/null_mutex.h>

#include "app/log.h"

namespace pneuma::app {
namespace {

using namespace std::chrono_literals;

class KeptLines final : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  std::vector<std::string> lines;

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    lines.emplace_back(message.payload.data(), message.payload.size());
  }
  void flush_() override {}
};

class LimitedSinkTest : public testing::Test {
 protected:
  void log(const std::string& text, spdlog::level::level_enum level = spdlog::level::info) {
    sink_.log({now_, {}, {}, level, text});
  }
  std::vector<std::string>& lines() { return kept_->lines; }

  std::shared_ptr<KeptLines> kept_ = std::make_shared<KeptLines>();
  LimitedSink sink_{kept_};
  LimitedSink::Clock::time_point now_ = LimitedSink::Clock::now();
};

TEST_F(LimitedSinkTest, TenAMinuteAndThenTheirCount) {
  for (int i = 0; i < 25; ++i) log("session=" + std::to_string(i) + " closed");
  EXPECT_EQ(lines().size(), 10U);
  EXPECT_EQ(sink_.dropped(), 15U);
  now_ += 1min;
  log("something else");
  ASSERT_EQ(lines().size(), 12U);
  EXPECT_EQ(lines()[10], "dropped_lines=15 like: session= closed");
  EXPECT_EQ(lines()[11], "something else");
  log("session=26 closed");
  EXPECT_EQ(lines().size(), 13U) << "the next minute has its own ten";
}

TEST_F(LimitedSinkTest, AFlushTellsTheCountSoFarOnce) {
  for (int i = 0; i < 11; ++i) log("again");
  sink_.flush();
  ASSERT_EQ(lines().size(), 11U);
  EXPECT_EQ(lines().back(), "dropped_lines=1 like: again");
  sink_.flush();
  EXPECT_EQ(lines().size(), 11U);
  log("again");
  EXPECT_EQ(lines().size(), 11U) << "the minute is not over";
}

TEST_F(LimitedSinkTest, DebugLinesAreNotLimited) {
  for (int i = 0; i < 100; ++i) log("step", spdlog::level::debug);
  EXPECT_EQ(lines().size(), 100U);
}

// Otherwise a client that calls itself something else each time would hide the lines that matter.
TEST_F(LimitedSinkTest, WhatClientsChooseMakesNoNewKind) {
  for (int i = 0; i < 1'000; ++i) {
    std::string name(1, static_cast<char>('a' + i % 26));
    name += std::string(static_cast<std::size_t>(i / 26), 'x');
    log("session=1 client=" + name + " said hello");
    log("session=1 closed: hello.token: \"" + name + "\" is none");
  }
  EXPECT_EQ(lines().size(), 20U);
  log("world=w disk: no space left", spdlog::level::err);
  EXPECT_EQ(lines().size(), 21U);
}

TEST_F(LimitedSinkTest, ALineStaysOneLine) {
  log("a\nb\x1b[2J \xe2\x80\xaeright to left");
  EXPECT_EQ(lines().front(), "a\\x0ab\\x1b[2J \\xe2\\x80\\xaeright to left");
}

TEST(KindOfLine, IsWhatTheServerSays) {
  EXPECT_EQ(kind_of_line("world=w-1 tick=12 halted: \"a b\" is 3 m off"), "world= tick= halted:  is  m off");
  EXPECT_EQ(kind_of_line("client=\"a b=c\" said hello"), "client= said hello");
}

TEST(LogName, IsPlainOrInQuotes) {
  EXPECT_EQ(log_name("five-balls_1.2"), "five-balls_1.2");
  EXPECT_EQ(log_name(""), "\"\"");
  EXPECT_EQ(log_name("x halted:"), "\"x halted:\"");
  EXPECT_EQ(log_name("a\" b\\n\n"), "\"a' b/n\\x0a\"");
  EXPECT_EQ(log_name("\xe2\x80\xae"), "\"\\xe2\\x80\\xae\"");
}

}  // namespace
}  // namespace pneuma::app
