// Shows that a failure keeps its code and text on the way up while its path grows at the front, and reads as one line.
#include "base/status.h"

#include <memory>
#include <string>

#include <gtest/gtest.h>

namespace pneuma::base {
namespace {

TEST(Status, IsOkUnlessItSaysOtherwise) {
  EXPECT_TRUE(Status().ok());
  const Status status = not_found("no such world", "world");
  EXPECT_FALSE(status.ok());
  EXPECT_EQ(status.code(), StatusCode::not_found);
  EXPECT_EQ(status.what(), "no such world");
  EXPECT_EQ(status.where(), "world");
}

TEST(Status, PathGrowsOutwardsWithDotsButNotBeforeAnIndex) {
  const Status inner = invalid("is -1", "mass_kg");
  EXPECT_EQ(inner.inside("soft_bodies[2]").where(), "soft_bodies[2].mass_kg");
  EXPECT_EQ(invalid("is -1", "[2].mass_kg").inside("soft_bodies").where(), "soft_bodies[2].mass_kg");
  EXPECT_EQ(invalid("is not a scene").inside("five-balls.json").where(), "five-balls.json");
}

TEST(Status, KeepsCodeAndTextWhenSeenFromOutside) {
  const Status outer = Status(StatusCode::limit_exceeded, "too many", "bodies").inside("scene");
  EXPECT_EQ(outer.code(), StatusCode::limit_exceeded);
  EXPECT_EQ(outer.what(), "too many");
}

TEST(Status, MessageIsOneLineWithThePlaceFirst) {
  EXPECT_EQ(invalid("is -1", "mass_kg").message(), "mass_kg: is -1");
  EXPECT_EQ(invalid("is not a scene").message(), "is not a scene");
}

TEST(Result, HoldsAValueOrTheReasonWhyThereIsNone) {
  const Result<std::string> value(std::string("here"));
  ASSERT_TRUE(value.ok());
  EXPECT_EQ(*value, "here");
  EXPECT_EQ(value->size(), 4U);
  const Result<std::string> none(invalid("nothing here"));
  EXPECT_FALSE(none.ok());
  EXPECT_EQ(none.status().what(), "nothing here");
}

TEST(Result, HandsOverAValueThatCannotBeCopied) {
  Result<std::unique_ptr<int>> result(std::make_unique<int>(7));
  const std::unique_ptr<int> owner = std::move(*result);
  EXPECT_EQ(*owner, 7);
}

}  // namespace
}  // namespace pneuma::base
