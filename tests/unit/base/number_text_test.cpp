// Shows that numbers in messages are as short as nine digits allow.
#include "base/number_text.h"

#include <gtest/gtest.h>

namespace pneuma::base {
namespace {

TEST(NumberText, HasNoDigitsThatSayNothing) {
  EXPECT_EQ(number_text(1000.0), "1000");
  EXPECT_EQ(number_text(0.5), "0.5");
  EXPECT_EQ(number_text(-1.0 / 3.0), "-0.333333333");
  EXPECT_EQ(number_text(1e-6), "1e-06");
  EXPECT_EQ(number_text(1e200), "1e+200");
}

}  // namespace
}  // namespace pneuma::base
