// Shows that no client takes all the names that there are.
#include "app/world_registry.h"

#include <string>

#include <gtest/gtest.h>

#include "base/limits.h"

namespace pneuma::app {
namespace {

using base::StatusCode;

TEST(WorldRegistry, AClientLeavesAFourthOfTheWorldsToOthers) {
  WorldRegistry registry(8);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(registry.reserve(std::string("a").append(std::to_string(i)), "a").ok());
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(registry.reserve_like("w", "a").ok());
  EXPECT_EQ(registry.reserve("a6", "a").code(), StatusCode::limit_exceeded);
  EXPECT_EQ(registry.reserve_like("w", "a").status().what(),
            "you have 6 of the server's 8 worlds; the others are for other clients");
  EXPECT_TRUE(registry.reserve("b", "b").ok());
  EXPECT_TRUE(registry.reserve("own").ok());
  EXPECT_EQ(registry.reserve("b2", "b").what(), "the server has its 8 worlds already");
  registry.erase("a0");
  EXPECT_TRUE(registry.reserve("a6", "a").ok());
}

TEST(WorldRegistry, AServerOfFewWorldsKeepsNoneBack) {
  WorldRegistry registry(2);
  EXPECT_TRUE(registry.reserve("a", "a").ok());
  EXPECT_TRUE(registry.reserve("b", "a").ok());
}

}  // namespace
}  // namespace pneuma::app
