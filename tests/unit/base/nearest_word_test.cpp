// Shows what a slip of the keyboard is taken to have meant, and that far words are not offered.
#include "base/nearest_word.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::base {
namespace {

const std::vector<std::string> worlds{"five-balls", "five-balls-2", "hand", "wind-cloth"};

TEST(NearestWord, OfOneChangeOrTwoIsFound) {
  EXPECT_EQ(nearest_word("five-bals", worlds), "five-balls");
  EXPECT_EQ(nearest_word("five-balls-3", worlds), "five-balls-2");
  EXPECT_EQ(nearest_word("hnad", worlds), "hand");
  EXPECT_EQ(nearest_word("windcloth", worlds), "wind-cloth");
}

TEST(NearestWord, FarOnesAreNotOffered) {
  EXPECT_EQ(nearest_word("bouncing-ball", worlds), "");
  EXPECT_EQ(nearest_word("hand", std::vector<std::string>{}), "");
  EXPECT_EQ(nearest_word(std::string(100'000, 'h'), worlds), "");
}

}  // namespace
}  // namespace pneuma::base
