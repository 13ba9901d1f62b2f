// Shows that worlds go their own ways: one far too heavy for its rate slows down and says so, and does not delay a
// light one on the same, only thread, beyond its slice.
#include "served.h"

namespace pneuma::integration {
namespace {

class Independence : public Served {};

TEST_F(Independence, AHeavyWorldSlowsItselfAndNotALightOne) {
  start({"--threads", "1"});
  client::Client client = connect();
  v1::Scene heavy = two_balls("heavy");
  heavy.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(4);
  heavy.mutable_stepping()->set_rate_hz(1000.0);
  heavy.mutable_stepping()->set_substeps(200);  // a billion vertex substeps a second, to keep up
  for (auto& body : *heavy.mutable_soft_bodies()) body.mutable_springs()->set_damping_n_s_m(0.01);
  create(client, heavy, "heavy");
  create(client, light_and_quick(), "light");
  ASSERT_TRUE(client.subscribe("heavy").ok());
  const auto slowed = await_event(client, v1::Event::WORLD_SLOWED);
  ASSERT_TRUE(slowed);
  EXPECT_EQ(slowed->world(), "heavy");

  const auto heavy_tick = client.stats("heavy")->tick();
  const auto light_tick = client.stats("light")->tick();
  // Two frames of the heavy world show that both went on together; under a sanitizer one of its ticks takes seconds.
  ASSERT_TRUE(await_frame(client, [&](const auto& frame) { return frame.tick >= heavy_tick + 2; }));
  const auto heavy_stats = client.stats("heavy");
  const auto light_stats = client.stats("light");
  EXPECT_LT(heavy_stats->time_ratio(), 0.9);
  EXPECT_GT(heavy_stats->slipped_s(), 0.0);
  // The light world had its turns within each tick of the heavy one.
  EXPECT_GT(light_stats->tick() - light_tick, 2 * (heavy_stats->tick() - heavy_tick));
}

TEST_F(Independence, APausedWorldStaysWhileOthersRun) {
  start({"--threads", "1"});
  client::Client client = connect();
  create(client, two_balls(), "paused", true);
  create(client, two_balls(), "running");
  ASSERT_TRUE(client.subscribe("running").ok());
  ASSERT_TRUE(await_frame(client, [](const auto& frame) { return frame.tick >= 20; }));
  EXPECT_EQ(client.stats("paused")->tick(), 0U);
  EXPECT_TRUE(client.stats("paused")->paused());
}

TEST_F(Independence, AWorldWhoseTickTakesHoursCanBeDestroyed) {
  start({"--threads", "1"});
  client::Client client = connect();
  v1::Scene endless = two_balls("endless");
  endless.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(6);
  endless.mutable_stepping()->set_substeps(4096);
  endless.mutable_stepping()->set_integrator(v1::Stepping::RK4);
  for (auto& body : *endless.mutable_soft_bodies()) {
    body.mutable_volume()->set_method(v1::Volume::MONTE_CARLO);
    body.mutable_volume()->set_resolution(65'536);
  }
  create(client, endless, "endless");
  EXPECT_TRUE(client.destroy_world("endless").ok());
  EXPECT_EQ(client.list_worlds()->worlds_size(), 0);
}

// A long step request runs in slices too: the running world keeps its pace, and the stepping session's other requests
// are answered meanwhile.
TEST_F(Independence, ALongStepDoesNotHoldUpAnything) {
  start({"--threads", "1"});
  client::Client stepper = connect();
  client::Client watcher = connect();
  create(stepper, two_balls(), "stepped", true);
  create(stepper, two_balls(), "running");
  ASSERT_TRUE(watcher.subscribe("running").ok());
  ASSERT_TRUE(watcher.subscribe("stepped").ok());
  const auto done = stepper.step("stepped", 600);
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->tick(), 600U);
  bool running_went_on = false;
  bool stepped_arrived = false;  // in either order: a fast machine steps 600 ticks within a few of the other world's
  EXPECT_TRUE(await_frame(watcher, [&](const auto& frame) {
    running_went_on |= frame.world == "running" && frame.tick > 5;
    stepped_arrived |= frame.world == "stepped" && frame.tick == 600;
    return running_went_on && stepped_arrived;
  }));
}

}  // namespace
}  // namespace pneuma::integration
