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

TEST(NearestWord, IsTheOneThatBeginsWithTheWordOrHoldsIt) {
  const std::vector<std::string> fields{"mesh", "mass_kg", "gas", "position", "stiffness_n_m", "icosphere"};
  EXPECT_EQ(nearest_word("mass", fields), "mass_kg");  // "mesh" is two changes away
  EXPECT_EQ(nearest_word("pos", fields), "position");
  EXPECT_EQ(nearest_word("stiffness", fields), "stiffness_n_m");
  EXPECT_EQ(nearest_word("sphere", fields), "icosphere");
  EXPECT_EQ(nearest_word("five", worlds), "five-balls");  // the shortest
  EXPECT_EQ(nearest_word("fi", worlds), "");
  EXPECT_EQ(nearest_word("", worlds), "");
}

TEST(NearestWord, OrAllThereAre) {
  EXPECT_EQ(nearest_or_all("hnad", worlds), "; did you mean hand?");
  EXPECT_EQ(nearest_or_all("qqqqqq", worlds), "; there are five-balls, five-balls-2, hand, wind-cloth");
  EXPECT_EQ(nearest_or_all("qqqqqq", std::vector<std::string>{"hand"}), "; there is hand");
  EXPECT_EQ(nearest_or_all("qqqqqq", std::vector<std::string>{}), "; there are none");
  const std::vector<std::string> many(1'000, "ball");
  EXPECT_TRUE(nearest_or_all("qqqqqq", many).ends_with("ball, ..."));
}

// The longest names, as many as a world has, would take 17 million steps.
TEST(NearestWord, ComesSoonAmongManyLongNames) {
  std::vector<std::string> names(1'024, std::string(128, 'a'));
  names.back() = std::string(105, 'b');
  EXPECT_EQ(nearest_word(std::string(100, 'b'), names), names.back());
}

TEST(NearestWord, FarOnesAreNotOffered) {
  EXPECT_EQ(nearest_word("bouncing-ball", worlds), "");
  EXPECT_EQ(nearest_word("hand", std::vector<std::string>{}), "");
  EXPECT_EQ(nearest_word(std::string(100'000, 'h'), worlds), "");
}

}  // namespace
}  // namespace pneuma::base
