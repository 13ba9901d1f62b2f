// Shows that a world's bytes give the same world back, and that bytes cut off or of another version are refused at
// every length.
#include "app/saved_world.h"

#include <gtest/gtest.h>

#include "ball_scene.h"

namespace pneuma::app {
namespace {

SavedWorld sample() {
  SavedWorld world;
  world.live.created = std::make_shared<const v1::Scene>(ball_scene());
  v1::Scene edited = ball_scene();
  edited.mutable_gravity()->set_y(-1.62);
  world.live.edited = std::make_shared<const v1::Scene>(edited);
  world.live.snapshot = std::string("\0snapshot\xff", 10);
  world.live.tick = 1ULL << 40;
  world.live.next_grab_id = 9;
  world.live.grabs = {{3, "ball"}, {8, "second"}};
  world.paused = true;
  return world;
}

TEST(SavedWorld, ComesBackAsItWas) {
  const auto back = from_bytes(to_bytes(sample()));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->live.created->SerializeAsString(), sample().live.created->SerializeAsString());
  EXPECT_EQ(back->live.edited->SerializeAsString(), sample().live.edited->SerializeAsString());
  EXPECT_EQ(back->live.snapshot, sample().live.snapshot);
  EXPECT_EQ(back->live.tick, sample().live.tick);
  EXPECT_EQ(back->live.next_grab_id, 9U);
  EXPECT_EQ(back->live.grabs, sample().live.grabs);
  EXPECT_TRUE(back->paused);
}

TEST(SavedWorld, CutOffAnywhereItIsRefused) {
  const std::string bytes = to_bytes(sample());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(from_bytes(std::string_view(bytes).substr(0, length)).ok()) << length;
  }
  EXPECT_FALSE(from_bytes(bytes + "x").ok());
}

TEST(SavedWorld, AnotherVersionIsRefused) {
  std::string bytes = to_bytes(sample());
  bytes[0] = 99;
  EXPECT_EQ(from_bytes(bytes).status().code(), base::StatusCode::unsupported);
}

}  // namespace
}  // namespace pneuma::app
