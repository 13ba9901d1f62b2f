// Shows the bar of long work at its ends, in the middle and on a narrow terminal.
#include "command/progress.h"

#include <gtest/gtest.h>

namespace pneuma::client {
namespace {

TEST(Progress, ABarIsAsFullAsTheWorkIsDone) {
  EXPECT_EQ(bar_text(0.0, "0 frames", 100), "[>                             ]   0 %  0 frames");
  EXPECT_EQ(bar_text(0.5, "5 frames", 100), "[===============>              ]  50 %  5 frames");
  EXPECT_EQ(bar_text(1.0, "10 frames", 100), "[==============================] 100 %  10 frames");
  EXPECT_EQ(bar_text(7.0, "", 100), bar_text(1.0, "", 100)) << "more than was thought";
}

TEST(Progress, WithoutAnEndInSightThereIsNoBar) {
  EXPECT_EQ(bar_text({}, "5 frames", 100), "5 frames");
}

TEST(Progress, ALineLeavesTheTerminalsLastColumnFree) {
  EXPECT_EQ(bar_text(0.5, "a long text", 20).size(), 19U);
  EXPECT_EQ(bar_text({}, "text", 0), "");
}

}  // namespace
}  // namespace pneuma::client
