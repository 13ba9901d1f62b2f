// Shows that bytes leave the sum a second after they came.
#include "app/recent_bytes.h"

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

using std::chrono::milliseconds;

TEST(RecentBytes, AreThoseOfTheLastSecond) {
  const RecentBytes::TimePoint start = RecentBytes::TimePoint() + std::chrono::hours(1);
  RecentBytes bytes;
  EXPECT_EQ(bytes.sum(start), 0U);
  for (int i = 0; i <= 20; ++i) bytes.add(start + milliseconds(100 * i), 10);
  EXPECT_EQ(bytes.sum(start + milliseconds(2'000)), 100U);
  EXPECT_EQ(bytes.sum(start + milliseconds(2'050)), 100U);
  EXPECT_EQ(bytes.sum(start + milliseconds(2'950)), 10U);
  EXPECT_EQ(bytes.sum(start + milliseconds(3'000)), 0U);
}

}  // namespace
}  // namespace pneuma::app
