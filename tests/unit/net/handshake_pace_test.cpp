// Shows that an address has a burst of handshakes and then one each interval, whatever others do.
#include "net/handshake_pace.h"

#include <gtest/gtest.h>

namespace pneuma::net {
namespace {

using std::chrono::milliseconds;

TEST(HandshakePace, AfterTheBurstOneBeginsEachInterval) {
  HandshakePace pace;
  const HandshakePace::TimePoint now{};
  for (int i = 0; i <= HandshakePace::burst; ++i) EXPECT_EQ(pace.wait("a", now), milliseconds(0)) << i;
  for (int i = 1; i <= 50; ++i) EXPECT_EQ(pace.wait("a", now), i * HandshakePace::interval);
  EXPECT_EQ(pace.wait("b", now), milliseconds(0));
}

TEST(HandshakePace, TheBurstComesBackWithTime) {
  HandshakePace pace;
  HandshakePace::TimePoint now{};
  for (int i = 0; i < 2 * HandshakePace::burst; ++i) static_cast<void>(pace.wait("a", now));
  now += HandshakePace::burst * HandshakePace::interval;
  EXPECT_EQ(pace.wait("a", now), milliseconds(0));
  EXPECT_EQ(pace.wait("a", now), HandshakePace::interval);
  now += 3 * HandshakePace::burst * HandshakePace::interval;
  for (int i = 0; i <= HandshakePace::burst; ++i) EXPECT_EQ(pace.wait("a", now), milliseconds(0)) << i;
}

// Who asks as often as it is answered is never answered more often than that.
TEST(HandshakePace, HoldsOverAMinute) {
  HandshakePace pace;
  HandshakePace::TimePoint now{};
  int begun = 0;
  for (; now < HandshakePace::TimePoint(std::chrono::minutes(1)); ++begun) now += pace.wait("a", now);
  EXPECT_LE(begun, HandshakePace::burst + 2 + std::chrono::minutes(1) / HandshakePace::interval);
}

}  // namespace
}  // namespace pneuma::net
