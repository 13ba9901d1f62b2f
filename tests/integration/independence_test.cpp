// Shows that worlds go their own ways: those that are far too heavy for their rates slow down and say so, and delay no
// light one on the same, only thread.
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>

#include "served.h"
#include "support/sanitizers.h"

namespace pneuma::integration {
namespace {

class Independence : public Served {};

/// Far more work than a thread has time for: a billion vertex substeps a second. A slice ends between two substeps of a
/// body; under a sanitizer one of a large body takes longer than another world may wait, so there bodies are smaller.
v1::Scene overloaded() {
  v1::Scene heavy = two_balls("heavy");
  heavy.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(support::is_sanitized ? 2 : 4);
  heavy.mutable_stepping()->set_rate_hz(1000.0);
  heavy.mutable_stepping()->set_substeps(support::is_sanitized ? 3200 : 200);
  for (auto& body : *heavy.mutable_soft_bodies()) body.mutable_springs()->set_damping_n_s_m(0.01);
  return heavy;
}

TEST_F(Independence, AHeavyWorldSlowsItselfAndNotALightOne) {
  start({"--threads", "1"});
  client::Client client = connect();
  create(client, overloaded(), "heavy");
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

// In the order of due times the light one would get two thirds of its time. Other programs may take the processor
// for a while: so the best of some seconds counts.
TEST_F(Independence, SixteenHeavyWorldsLeaveALightOneAllOfItsTime) {
  start({"--threads", "1"});
  client::Client client = connect();
  for (int i = 0; i < 16; ++i) create(client, overloaded(), "heavy-" + std::to_string(i));
  v1::Scene light = two_balls("light");
  light.mutable_stepping()->set_rate_hz(60.0);
  // By the method that it has for this many substeps alone, it would need a seventh of the thread once it has landed.
  light.mutable_stepping()->set_integrator(v1::Stepping::SYMPLECTIC_EULER);
  if (support::is_sanitized) {  // ten times as slow, it would not keep within a seventeenth of the thread
    light.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(0);
    light.mutable_stepping()->set_rate_hz(20.0);
  }
  create(client, light, "light");
  ASSERT_TRUE(client.subscribe("light").ok());
  double best = 0.0;
  constexpr double wanted = 0.8;
  const auto second = static_cast<std::uint64_t>(light.stepping().rate_hz());
  for (std::uint64_t tick = 2 * second; tick <= 12 * second && best < wanted; tick += second) {
    ASSERT_TRUE(await_frame(client, [tick](const auto& frame) { return frame.tick >= tick; }));
    best = std::max(best, client.stats("light")->time_ratio());
  }
  EXPECT_GE(best, wanted);
  // Statistics would come between two ticks of a heavy world, which take seconds.
  const auto list = client.list_worlds();
  ASSERT_TRUE(list.ok());
  double light_s = 0.0;
  for (const auto& world : list->worlds()) light_s = std::max(light_s, world.time_s());
  for (const auto& world : list->worlds()) {
    if (world.name() == "light") continue;
    EXPECT_LT(world.time_s(), 0.5 * light_s) << world.name();
  }
}

// To set it up is one slice of the only thread; a spare one ticks the light world meanwhile.
TEST_F(Independence, AnEditThatTakesLongHoldsUpNobodyElse) {
  start({"--threads", "1"});
  client::Client editor = connect();
  client::Client watcher = connect();
  v1::Scene stiff = two_balls("stiff");
  stiff.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(6);
  stiff.mutable_stepping()->set_integrator(v1::Stepping::IMPLICIT_EULER);
  stiff.mutable_stepping()->set_substeps(1);
  create(editor, stiff, "stiff", true);
  create(editor, light_and_quick(), "light");
  ASSERT_TRUE(watcher.subscribe("light").ok());
  v1::SceneEdit edit;
  v1::SoftBodyChange& change = *edit.add_changes()->mutable_change_soft_body();
  change.set_name("left");
  change.mutable_springs()->set_stiffness_n_m(5'000.0);
  ASSERT_TRUE(await_frame(watcher));
  std::atomic<bool> edited = false;
  std::thread editing([&] {
    EXPECT_TRUE(editor.edit("stiff", edit).ok());
    edited = true;
  });
  std::optional<std::uint64_t> first_tick;
  std::uint64_t last_tick = 0;
  EXPECT_TRUE(await_frame(watcher, [&](const auto& frame) {
    last_tick = frame.tick;
    if (!first_tick) first_tick = frame.tick;
    return edited.load();
  }));
  editing.join();
  EXPECT_GT(last_tick - *first_tick, 5U);
}

TEST_F(Independence, AWorldPastItsBudgetWaitsAndSaysWhy) {
  const std::string share = support::is_sanitized ? "0.25" : "0.05";  // a tick takes seconds there
  start({"--world-processors-max", share});
  client::Client client = connect();
  create(client, overloaded(), "heavy");
  ASSERT_TRUE(client.subscribe("heavy").ok());
  // It may have slowed before, while there was a little left.
  bool is_told = false;
  for (int event = 0; event < 3 && !is_told; ++event) {
    const auto slowed = await_event(client, v1::Event::WORLD_SLOWED);
    ASSERT_TRUE(slowed);
    is_told = slowed->detail().find("it may take " + share + " processor seconds a second") != std::string::npos;
  }
  EXPECT_TRUE(is_told);
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
  create(client, endless(), "endless");
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
