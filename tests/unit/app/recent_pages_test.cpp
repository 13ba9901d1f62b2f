// Shows that making a page takes a twentieth of the time at most, and that one that is cheap is always new.
#include "app/recent_pages.h"

#include <string>

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

class RecentPagesTest : public testing::Test {
 protected:
  /// Asks for a page that takes so long to make; whether it was made now.
  bool is_made(const std::string& name, milliseconds takes) {
    const int before = made_;
    const net::HttpReply reply = pages_.get(
        name, [this] { return now_; },
        [&] {
          now_ += takes;
          return net::text_reply(200, name + std::to_string(++made_));
        });
    EXPECT_TRUE(reply.body != nullptr && reply.body->starts_with(name));
    return made_ > before;
  }

  RecentPages pages_;
  steady_clock::time_point now_{};
  int made_ = 0;
};

TEST_F(RecentPagesTest, MakingOneTakesATwentiethOfTheTime) {
  milliseconds spent{0};
  const auto begin = now_;
  for (int i = 0; i < 10'000; ++i) {
    if (is_made("metrics", milliseconds(5))) spent += milliseconds(5);
    now_ += milliseconds(1);
  }
  const auto whole = now_ - begin;
  EXPECT_LE(20 * spent, whole + milliseconds(200));
  EXPECT_GE(22 * spent, whole);
}

TEST_F(RecentPagesTest, OneThatTakesNoTimeIsAlwaysNew) {
  EXPECT_TRUE(is_made("health", milliseconds(0)));
  EXPECT_TRUE(is_made("health", milliseconds(0)));
}

TEST_F(RecentPagesTest, EachIsKeptByItself) {
  EXPECT_TRUE(is_made("metrics a", milliseconds(5)));
  EXPECT_TRUE(is_made("metrics b", milliseconds(5)));
  EXPECT_FALSE(is_made("metrics a", milliseconds(5)));
  EXPECT_FALSE(is_made("metrics b", milliseconds(5)));
}

}  // namespace
}  // namespace pneuma::app
