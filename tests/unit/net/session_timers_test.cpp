// Shows each time limit of a session at its edge: nothing a millisecond before, the action at it. Time is passed in;
// nothing waits.
#include "net/session_timers.h"

#include <gtest/gtest.h>

namespace pneuma::net {
namespace {

using namespace std::chrono_literals;
using TimePoint = SessionTimers::TimePoint;

const base::Limits limits;  // the defaults: hello 2 s, partial message 10 s, ping 15 s, write stall 10 s
const TimePoint opened_at{1000s};

bool does_nothing(const SessionTimers::Action& action) {
  return std::holds_alternative<SessionTimers::Nothing>(action);
}
bool closes(const SessionTimers::Action& action) {
  return std::holds_alternative<base::Status>(action);
}
std::uint64_t ping_in(const SessionTimers::Action& action) {
  const auto* ping = std::get_if<SessionTimers::SendPing>(&action);
  EXPECT_NE(ping, nullptr);
  return ping == nullptr ? 0 : ping->nonce;
}

TEST(SessionTimers, HelloHasTwoSeconds) {
  SessionTimers timers(limits, opened_at);
  EXPECT_TRUE(does_nothing(timers.poll(opened_at + 1999ms)));
  EXPECT_TRUE(closes(timers.poll(opened_at + 2000ms)));
}

TEST(SessionTimers, HelloEndsItsTimeOut) {
  SessionTimers timers(limits, opened_at);
  timers.authenticated(opened_at + 1s);
  EXPECT_TRUE(does_nothing(timers.poll(opened_at + 3s)));
}

TEST(SessionTimers, APartialMessageHasTenSecondsFromItsFirstByte) {
  SessionTimers timers(limits, opened_at);
  timers.authenticated(opened_at);
  timers.received(opened_at + 1s, true);
  timers.received(opened_at + 10s, true);  // a byte more wins no time
  EXPECT_TRUE(does_nothing(timers.poll(opened_at + 10999ms)));
  EXPECT_TRUE(closes(timers.poll(opened_at + 11s)));
}

TEST(SessionTimers, AMessageThatEndsIsNoLongerPartial) {
  SessionTimers timers(limits, opened_at);
  timers.authenticated(opened_at);
  timers.received(opened_at + 1s, true);
  timers.received(opened_at + 9s, false);
  EXPECT_TRUE(does_nothing(timers.poll(opened_at + 14s)));
}

TEST(SessionTimers, AnsweredPingsGoOnForEver) {
  SessionTimers timers(limits, opened_at);
  timers.authenticated(opened_at);
  for (int i = 1; i <= 100; ++i) {
    EXPECT_TRUE(does_nothing(timers.poll(opened_at + i * 15s - 1ms)));
    timers.pong(ping_in(timers.poll(opened_at + i * 15s)));
  }
}

TEST(SessionTimers, TheSecondUnansweredPingCloses) {
  SessionTimers timers(limits, opened_at);
  timers.authenticated(opened_at);
  ping_in(timers.poll(opened_at + 15s));
  ping_in(timers.poll(opened_at + 30s));
  EXPECT_TRUE(does_nothing(timers.poll(opened_at + 45s - 1ms)));
  EXPECT_TRUE(closes(timers.poll(opened_at + 45s)));
}

TEST(SessionTimers, AWrongNonceIsNoAnswer) {
  SessionTimers timers(limits, opened_at);
  timers.authenticated(opened_at);
  for (int i = 1; i <= 2; ++i) timers.pong(ping_in(timers.poll(opened_at + i * 15s)) + 1);
  EXPECT_TRUE(closes(timers.poll(opened_at + 45s)));
}

TEST(SessionTimers, WhileNothingIsReadNoPingIsMissed) {
  SessionTimers timers(limits, opened_at);
  timers.authenticated(opened_at);
  ping_in(timers.poll(opened_at + 15s));
  timers.reading_paused();
  for (int i = 2; i <= 10; ++i) EXPECT_TRUE(does_nothing(timers.poll(opened_at + i * 15s)));
  timers.reading_resumed(opened_at + 150s);
  EXPECT_TRUE(does_nothing(timers.poll(opened_at + 165s - 1ms))) << "the pong is to be read first";
  ping_in(timers.poll(opened_at + 165s));
  EXPECT_TRUE(closes(timers.poll(opened_at + 180s)));
}

TEST(SessionTimers, AWriteMustGetOnWithinTenSeconds) {
  SessionTimers timers(limits, opened_at);
  timers.authenticated(opened_at);
  timers.write_progressed(opened_at);
  timers.write_progressed(opened_at + 4s);
  EXPECT_TRUE(does_nothing(timers.poll(opened_at + 14s - 1ms)));
  EXPECT_TRUE(closes(timers.poll(opened_at + 14s)));
}

TEST(SessionTimers, ADoneWriteCannotStall) {
  SessionTimers timers(limits, opened_at);
  timers.authenticated(opened_at);
  timers.write_progressed(opened_at);
  timers.write_done();
  EXPECT_TRUE(does_nothing(timers.poll(opened_at + 14s)));
}

TEST(SessionTimers, AClosingSessionHasTheTimeForItsGoodbyeAlone) {
  SessionTimers timers(limits, opened_at);
  timers.closing_until(opened_at + 30s);
  EXPECT_TRUE(does_nothing(timers.poll(opened_at + 29s))) << "no hello, but that does not count any more";
  EXPECT_TRUE(closes(timers.poll(opened_at + 30s)));
}

}  // namespace
}  // namespace pneuma::net
