// Shows that the bucket lets a burst through at once, then the stated rate, and says how long to wait. Time is made up.
#include "app/token_bucket.h"

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

using std::chrono::milliseconds;

const TokenBucket::TimePoint bucket_start = TokenBucket::TimePoint() + std::chrono::hours(1);

TEST(TokenBucket, BurstPassesAtOnceThenItWaits) {
  TokenBucket bucket(60.0, 120.0);
  for (int i = 0; i < 120; ++i) EXPECT_EQ(bucket.take(bucket_start), 0.0);
  EXPECT_DOUBLE_EQ(bucket.take(bucket_start), 1.0 / 60.0);
}

TEST(TokenBucket, RefillsAtItsRateAndNoFurtherThanTheBurst) {
  TokenBucket bucket(10.0, 5.0);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(bucket.take(bucket_start), 0.0);
  EXPECT_GT(bucket.take(bucket_start + milliseconds(99)), 0.0);
  EXPECT_EQ(bucket.take(bucket_start + milliseconds(101)), 0.0);
  const auto later = bucket_start + std::chrono::hours(1);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(bucket.take(later), 0.0);
  EXPECT_GT(bucket.take(later), 0.0);
}

TEST(TokenBucket, AClockThatStepsBackGivesNothing) {
  TokenBucket bucket(10.0, 1.0);
  EXPECT_EQ(bucket.take(bucket_start), 0.0);
  EXPECT_GT(bucket.take(bucket_start - std::chrono::minutes(1)), 0.0);
  EXPECT_GT(bucket.take(bucket_start), 0.0);
}

}  // namespace
}  // namespace pneuma::app
