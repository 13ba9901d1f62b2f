// Shows that every message does what it says, on good input: a real server, a real socket, the client library.
#include <algorithm>
#include <map>
#include <string>

#include "served.h"
#include "support/program.h"

namespace pneuma::integration {
namespace {

class Messages : public Served {
 protected:
  void SetUp() override {
    start();
    client_.emplace(connect());
    create(*client_, two_balls(), "w", true);
  }

  client::Client& client() { return *client_; }
  v1::Stats stats() {
    auto stats = client().stats("w");
    EXPECT_TRUE(stats.ok()) << stats.status().message();
    return *stats;
  }

  std::optional<client::Client> client_;
};

TEST_F(Messages, HelloGetsTheServersVersionAndLimits) {
  EXPECT_EQ(client().welcome().protocol_version(), 1U);
  EXPECT_FALSE(client().welcome().server_version().empty());
  EXPECT_GT(client().welcome().session_id(), 0U);
  EXPECT_EQ(client().welcome().message_bytes_max(), 1024U * 1024U);
}

TEST_F(Messages, PingComesBack) {
  EXPECT_TRUE(client().ping().ok());
}

TEST_F(Messages, ListNamesTheWorlds) {
  create(client(), two_balls(), "other");
  const auto list = client().list_worlds();
  ASSERT_TRUE(list.ok());
  ASSERT_EQ(list->worlds_size(), 2);
  EXPECT_EQ(list->worlds(0).name(), "other");
  const auto& world = list->worlds(1);
  EXPECT_EQ(world.name(), "w");
  EXPECT_EQ(world.scene_name(), "two-balls");
  EXPECT_TRUE(world.paused());
  EXPECT_EQ(world.tick(), 0U);
  EXPECT_EQ(world.soft_bodies(), 2U);
  EXPECT_EQ(world.rigid_bodies(), 1U);
  EXPECT_EQ(world.vertices(), 324U);
  EXPECT_DOUBLE_EQ(world.rate_hz(), 60.0);
}

TEST_F(Messages, ListCountsTheFrozenBodies) {
  v1::Impulse impulse;
  impulse.set_world("w");
  *impulse.mutable_impulse() = vec(0.0, 1e8, 0.0);  // past the limit of speed
  for (const char* body : {"left", "stone"}) {
    impulse.set_body(body);
    ASSERT_TRUE(client().impulse(impulse).ok());
  }
  EXPECT_EQ(client().list_worlds()->worlds(0).frozen_bodies(), 0U);
  ASSERT_TRUE(client().step("w", 1).ok());
  EXPECT_EQ(client().list_worlds()->worlds(0).frozen_bodies(), 2U);
  const auto listed = support::run_program("pneuma", {"--server", server_->tcp_address(), "worlds"});
  EXPECT_NE(listed.output.find("paused, 2 frozen"), std::string::npos) << listed.output;
  ASSERT_TRUE(client().reset("w").ok());
  EXPECT_EQ(client().list_worlds()->worlds(0).frozen_bodies(), 0U);
}

TEST_F(Messages, CreateTakesBuiltInsScenesAndJsonAndFindsNames) {
  EXPECT_EQ(client().create_builtin("bouncing-ball")->world(), "bouncing-ball");
  EXPECT_EQ(client().create_builtin("bouncing-ball")->world(), "bouncing-ball-2");
  v1::CreateWorld json;
  json.set_scene_json(R"({"name": "from json", "meshes": [{"name": "m", "icosphere": {"subdivisions": 1}}],
                          "soft_bodies": [{"name": "b", "mesh": "m"}]})");
  const auto done = client().create_world(json);
  ASSERT_TRUE(done.ok()) << done.status().message();
  EXPECT_EQ(done->world(), "from-json");
}

TEST_F(Messages, CreateTellsWhatItMended) {
  v1::CreateWorld json;
  json.set_scene_json(R"({"name": "mended", "meshes": [{"name": "m", "mend": {}, "triangles": {
      "positions": [{}, {"x": 1}, {"y": 1}, {"z": 1}], "indices": [0, 2, 1, 0, 1, 3, 0, 3, 2]}}],
      "soft_bodies": [{"name": "b", "mesh": "m", "gas": {"moles": 0.001}}]})");
  const auto done = client().create_world(json);
  ASSERT_TRUE(done.ok()) << done.status().message();
  ASSERT_EQ(done->mended_size(), 1);
  EXPECT_EQ(done->mended(0).detail(), "1 hole closed with 1 face");
}

TEST_F(Messages, DestroyEndsTheWorldAndFreesItsName) {
  ASSERT_TRUE(client().subscribe("w").ok());
  ASSERT_TRUE(client().destroy_world("w").ok());
  const auto event = await_event(client(), v1::Event::WORLD_DESTROYED);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->world(), "w");
  EXPECT_EQ(client().stats("w").status().code(), base::StatusCode::not_found);
  EXPECT_EQ(client().list_worlds()->worlds_size(), 0);
  create(client(), two_balls(), "w");
}

TEST_F(Messages, StepRunsExactlyTheTicksAskedFor) {
  const auto done = client().step("w", 30);
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->tick(), 30U);
  EXPECT_EQ(stats().tick(), 30U);
  EXPECT_NEAR(stats().time_s(), 0.5, 1e-9);
}

TEST_F(Messages, TheSameStepsGiveTheSameHash) {
  create(client(), two_balls(), "twin", true);
  ASSERT_TRUE(client().step("w", 40).ok());
  ASSERT_TRUE(client().step("twin", 15).ok());
  ASSERT_TRUE(client().step("twin", 25).ok());
  EXPECT_EQ(stats().state_hash(), client().stats("twin")->state_hash());
}

TEST_F(Messages, ResumeRunsAndPauseHolds) {
  ASSERT_TRUE(client().subscribe("w").ok());
  ASSERT_TRUE(client().resume("w").ok());
  ASSERT_TRUE(await_frame(client(), [](const auto& frame) { return frame.tick >= 5; }));
  ASSERT_TRUE(client().pause("w").ok());
  const auto tick = stats().tick();
  EXPECT_GE(tick, 5U);
  EXPECT_TRUE(stats().paused());
  EXPECT_EQ(stats().tick(), tick);
}

TEST_F(Messages, FramesShowWhereTheWorldIs) {
  const auto subscribed = client().subscribe("w", {.rate_hz = 30.0, .max_error_m = 1e-4});
  ASSERT_TRUE(subscribed.ok());
  EXPECT_EQ(subscribed->rate_hz(), 30.0);
  EXPECT_EQ(subscribed->max_error_m(), 1e-4);
  ASSERT_TRUE(client().step("w", 10).ok());
  const auto frame = await_frame(client(), [](const auto& candidate) { return candidate.tick == 10; });
  ASSERT_TRUE(frame);
  ASSERT_EQ(frame->bodies.size(), 2U);
  EXPECT_EQ(frame->bodies[0].name, "left");
  EXPECT_EQ(frame->bodies[0].topology->indices.size(), 3U * 320U);
  ASSERT_EQ(frame->solids.size(), 2U);
  EXPECT_EQ(frame->solids[0].name, "stone");
  EXPECT_TRUE(frame->solids[0].dynamic);
  // The centre of mass, from the frame and from the stats.
  const v1::Stats now = stats();
  for (std::size_t body = 0; body < 2; ++body) {
    double y = 0.0;
    for (std::size_t v = 0; v < 162; ++v) y += frame->bodies[body].positions_m[3 * v + 1] / 162.0;
    EXPECT_NEAR(y, now.soft_bodies(static_cast<int>(body)).centre_of_mass().y(), 1e-4);
  }
}

TEST_F(Messages, UnsubscribeEndsTheFrames) {
  const auto subscribed = client().subscribe("w");
  ASSERT_TRUE(await_frame(client()));
  ASSERT_TRUE(client().unsubscribe(subscribed->stream_id()).ok());
  ASSERT_TRUE(client().step("w", 5).ok());
  EXPECT_EQ(stats().subscribers(), 0U);
  const auto frame = client().next_frame(std::chrono::milliseconds(0));
  ASSERT_TRUE(frame.ok());
  EXPECT_FALSE(*frame);
}

TEST_F(Messages, AnImpulseMovesTheBodyByItsMomentum) {
  v1::Impulse impulse;
  impulse.set_world("w");
  impulse.set_body("left");
  *impulse.mutable_impulse() = vec(3.0, 0.0, 0.0);
  const auto before = stats().soft_bodies(0).momentum();
  const auto done = client().impulse(impulse);
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->tick(), 1U);
  EXPECT_NEAR(stats().soft_bodies(0).momentum().x() - before.x(), 3.0, 1e-9);
  EXPECT_EQ(stats().soft_bodies(1).momentum().x(), 0.0);

  impulse.set_vertex(0);
  ASSERT_TRUE(client().impulse(impulse).ok());
  *impulse.mutable_near()->mutable_position() = vec(-3.0, 3.0, 0.0);
  impulse.mutable_near()->set_radius_m(0.5);
  ASSERT_TRUE(client().impulse(impulse).ok());
  EXPECT_NEAR(stats().soft_bodies(0).momentum().x() - before.x(), 9.0, 1e-9);
  impulse.set_body("stone");
  impulse.clear_at();
  ASSERT_TRUE(client().impulse(impulse).ok());
  EXPECT_NEAR(stats().rigid_bodies(0).velocity().x(), 3.0, 1e-9);
}

TEST_F(Messages, ARayHitsTheFirstBodyInItsWay) {
  v1::Impulse impulse;
  impulse.set_world("w");
  *impulse.mutable_ray()->mutable_origin() = vec(10.0, 3.0, 0.0);
  *impulse.mutable_ray()->mutable_direction() = vec(-1.0, 0.0, 0.0);
  *impulse.mutable_impulse() = vec(-1.0, 0.0, 0.0);
  const auto done = client().impulse(impulse);
  ASSERT_TRUE(done.ok()) << done.status().message();
  EXPECT_NE(done->detail().find("right"), std::string::npos) << done->detail();
  EXPECT_NEAR(stats().soft_bodies(1).momentum().x(), -1.0, 1e-9);
}

TEST_F(Messages, EditsAddChangeAndRemove) {
  v1::SceneEdit edit;
  auto& third = *edit.add_changes()->mutable_add_soft_body();
  third = two_balls().soft_bodies(0);
  third.set_name("third");
  third.mutable_position()->set_y(8.0);
  edit.add_changes()->set_remove_soft_body("right");
  edit.add_changes()->set_remove_rigid_body("stone");
  *edit.add_changes()->mutable_set_gravity() = vec(0.0, -1.62, 0.0);
  ASSERT_TRUE(client().subscribe("w").ok());
  const auto done = client().edit("w", edit);
  ASSERT_TRUE(done.ok()) << done.status().message();
  const auto frame = await_frame(client(), [](const auto& candidate) {
    return candidate.bodies.size() == 2 && candidate.bodies[1].name == "third";
  });
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->solids.size(), 1U);

  const auto json =
      client().edit_json("w", R"({"changes": [{"change_soft_body": {"name": "left", "gas": {"moles": 0.05}}}]})");
  ASSERT_TRUE(json.ok()) << json.status().message();
  EXPECT_NEAR(stats().soft_bodies(0).moles(), 0.05, 1e-12);
  const auto scene = client().scene("w");
  ASSERT_TRUE(scene.ok());
  EXPECT_EQ(scene->scene().gravity().y(), -1.62);
  ASSERT_EQ(scene->scene().soft_bodies_size(), 2);
  EXPECT_EQ(scene->scene().soft_bodies(1).name(), "third");
}

TEST_F(Messages, AnAddedColliderHolds) {
  ASSERT_TRUE(client()
                  .edit_json("w", R"({"changes": [{"remove_rigid_body": "stone"},
                    {"add_collider": {"name": "shelf", "shape": {"plane": {}}, "position": {"y": 1.5}}}]})")
                  .ok());
  ASSERT_TRUE(client().step("w", 180).ok());
  EXPECT_GT(stats().soft_bodies(0).centre_of_mass().y(), 1.6) << "on the shelf, not on the floor under it";
}

TEST_F(Messages, AChangedColliderMovesWhatItHolds) {
  ASSERT_TRUE(client().step("w", 30).ok());
  EXPECT_NEAR(stats().rigid_bodies(0).position().y(), 0.5, 0.02) << "the stone lies on the floor";
  ASSERT_TRUE(
      client().edit_json("w", R"({"changes": [{"change_collider": {"name": "floor", "position": {"y": -1}}}]})").ok());
  ASSERT_TRUE(client().step("w", 120).ok());
  EXPECT_NEAR(stats().rigid_bodies(0).position().y(), -0.5, 0.02);
}

TEST_F(Messages, ARemovedColliderHoldsNoMore) {
  ASSERT_TRUE(client().edit_json("w", R"({"changes": [{"remove_collider": "floor"}]})").ok());
  ASSERT_TRUE(client().step("w", 60).ok());
  const double fallen_m = 0.5 - stats().rigid_bodies(0).position().y();
  EXPECT_NEAR(fallen_m, 0.5 * 9.81, 0.1) << "a second of free fall";
}

TEST_F(Messages, AnAddedRigidBodyFallsAndIsInTheFrames) {
  ASSERT_TRUE(client().subscribe("w").ok());
  ASSERT_TRUE(client()
                  .edit_json("w", R"({"changes": [{"add_rigid_body": {"name": "crate",
                    "shape": {"box": {"half_extents": {"x": 0.2, "y": 0.2, "z": 0.2}}}, "position": {"y": 9}}}]})")
                  .ok());
  ASSERT_TRUE(client().step("w", 30).ok());
  const v1::Stats now = stats();
  ASSERT_EQ(now.rigid_bodies_size(), 2);
  EXPECT_EQ(now.rigid_bodies(1).name(), "crate");
  EXPECT_NEAR(9.0 - now.rigid_bodies(1).position().y(), 0.5 * 9.81 * 0.25, 0.05);
  EXPECT_NEAR(now.rigid_bodies(1).velocity().y(), -0.5 * 9.81, 1e-6);
  const auto frame = await_frame(client(), [](const auto& candidate) { return candidate.tick == 30; });
  ASSERT_TRUE(frame);
  const auto crate =
      std::ranges::find(frame->solids, std::string("crate"), [](const auto& solid) { return solid.name; });
  ASSERT_NE(crate, frame->solids.end());
  EXPECT_TRUE(crate->dynamic);
}

TEST_F(Messages, AnEditOfTheSteppingShowsInTheStats) {
  ASSERT_TRUE(client()
                  .edit_json("w", R"({"changes": [{"set_stepping":
                    {"rate_hz": 30, "substeps": 24, "integrator": "SYMPLECTIC_EULER"}}]})")
                  .ok());
  const v1::Stats changed = stats();
  EXPECT_EQ(changed.rate_hz(), 30.0);
  EXPECT_EQ(changed.substeps(), 24U);
  EXPECT_EQ(changed.integrator(), "SYMPLECTIC_EULER");
  ASSERT_TRUE(client().step("w", 30).ok());
  EXPECT_NEAR(stats().time_s(), 1.0, 1e-12);
}

TEST_F(Messages, WindThatIsReversedBlowsTheOtherWay) {
  ASSERT_TRUE(client().create_builtin("wind-cloth", "cloth", true).ok());
  const auto bulge_m = [this] {
    const auto now = client().stats("cloth");
    EXPECT_TRUE(now.ok()) << now.status().message();
    return now->soft_bodies(0).centre_of_mass().z();
  };
  ASSERT_TRUE(client().step("cloth", 120).ok());
  EXPECT_GT(bulge_m(), 0.05);
  ASSERT_TRUE(client().edit_json("cloth", R"({"changes": [{"set_wind": {"z": -8}}]})").ok());
  ASSERT_TRUE(client().step("cloth", 120).ok());
  EXPECT_LT(bulge_m(), -0.05);
}

// Each stream keeps what was asked for, as near to it as the world's rate divides.
TEST_F(Messages, AnEditOfTheRateTellsEachStreamItsOwn) {
  const auto full = client().subscribe("w");
  const auto third = client().subscribe("w", {.rate_hz = 20.0});
  const auto odd = client().subscribe("w", {.rate_hz = 13.0});
  ASSERT_TRUE(full.ok() && third.ok() && odd.ok());
  EXPECT_EQ(odd->rate_hz(), 12.0);
  ASSERT_TRUE(client().edit_json("w", R"({"changes": [{"set_stepping": {"rate_hz": 120, "substeps": 8}}]})").ok());
  std::map<std::uint32_t, double> rates;
  for (int i = 0; i < 3; ++i) {
    const auto event = await_event(client(), v1::Event::STREAM_RATE_CHANGED);
    ASSERT_TRUE(event);
    EXPECT_EQ(event->world(), "w");
    rates[event->stream_id()] = event->rate_hz();
  }
  EXPECT_EQ(rates, (std::map<std::uint32_t, double>{
                       {full->stream_id(), 120.0}, {third->stream_id(), 20.0}, {odd->stream_id(), 120.0 / 9.0}}));
}

TEST_F(Messages, AGrabDragsAndLetsGo) {
  v1::Grab grab;
  grab.set_world("w");
  grab.set_body("left");
  grab.set_vertex(0);
  *grab.mutable_target() = vec(-2.0, 8.0, 0.0);
  const auto grabbed = client().grab(grab);
  ASSERT_TRUE(grabbed.ok()) << grabbed.status().message();
  EXPECT_EQ(grabbed->body(), "left");
  EXPECT_EQ(grabbed->tick(), 1U);
  ASSERT_TRUE(client().step("w", 30).ok());
  const v1::Stats held = stats();
  EXPECT_GT(held.soft_bodies(0).centre_of_mass().y(), held.soft_bodies(1).centre_of_mass().y() + 0.1);
  EXPECT_TRUE(client().move_grab("w", grabbed->grab_id(), vec(-2.0, 9.0, 0.0)).ok());
  EXPECT_TRUE(client().release_grab("w", grabbed->grab_id()).ok());
  EXPECT_EQ(client().release_grab("w", grabbed->grab_id()).status().code(), base::StatusCode::not_found);
}

TEST_F(Messages, ResetBringsTheSceneBackAndTicksGoOn) {
  const auto fresh = stats().state_hash();
  ASSERT_TRUE(client().subscribe("w").ok());
  ASSERT_TRUE(client().step("w", 20).ok());
  ASSERT_TRUE(client().reset("w").ok());
  EXPECT_TRUE(await_event(client(), v1::Event::WORLD_RESET));
  EXPECT_EQ(stats().state_hash(), fresh);
  EXPECT_EQ(stats().tick(), 20U);
  EXPECT_EQ(stats().time_s(), 0.0);
}

TEST_F(Messages, StatsTellOfTheWorld) {
  ASSERT_TRUE(client().subscribe("w").ok());
  ASSERT_TRUE(client().step("w", 3).ok());
  const v1::Stats out = stats();
  EXPECT_EQ(out.world(), "w");
  EXPECT_EQ(out.substeps(), 8U);
  EXPECT_EQ(out.integrator(), "SYMPLECTIC_EULER") << "as AUTO picks";
  EXPECT_EQ(out.subscribers(), 1U);
  EXPECT_EQ(out.quality_classes(), 1U);
  EXPECT_EQ(out.time_ratio(), 1.0);
  EXPECT_EQ(out.soft_bodies_size(), 2);
  EXPECT_EQ(out.soft_bodies(0).vertices(), 162U);
  EXPECT_GT(out.soft_bodies(0).volume_m3(), 0.0);
  EXPECT_GT(out.stages_size(), 0);
}

TEST_F(Messages, StatsTellWhoSleeps) {
  v1::Scene scene = two_balls("still");
  scene.clear_gravity();
  for (v1::SoftBody& ball : *scene.mutable_soft_bodies()) ball.clear_gas();  // at its rest lengths
  create(client(), scene, "still", true);
  ASSERT_TRUE(client().step("still", 20).ok());
  EXPECT_FALSE(client().stats("still")->soft_bodies(0).asleep());
  ASSERT_TRUE(client().step("still", 20).ok());
  EXPECT_TRUE(client().stats("still")->soft_bodies(0).asleep());
  EXPECT_TRUE(client().stats("still")->rigid_bodies(0).asleep());
  v1::Impulse impulse;
  impulse.set_world("still");
  impulse.set_body("left");
  *impulse.mutable_impulse() = vec(1.0, 0.0, 0.0);
  ASSERT_TRUE(client().impulse(impulse).ok());
  ASSERT_TRUE(client().step("still", 1).ok());
  const auto woken = client().stats("still");
  EXPECT_FALSE(woken->soft_bodies(0).asleep());
  EXPECT_TRUE(woken->soft_bodies(1).asleep());
  EXPECT_TRUE(woken->rigid_bodies(0).asleep());
}

TEST_F(Messages, ASessionsGrabsEndWithIt) {
  {
    client::Client other = connect();
    v1::Grab grab;
    grab.set_world("w");
    grab.set_body("left");
    grab.set_vertex(0);
    *grab.mutable_target() = vec(-2.0, 100.0, 0.0);
    const auto grabbed = other.grab(grab);
    ASSERT_TRUE(grabbed.ok());
    EXPECT_EQ(client().release_grab("w", grabbed->grab_id()).status().code(), base::StatusCode::not_found)
        << "another session's";
    ASSERT_TRUE(other.subscribe("w").ok());
    EXPECT_EQ(stats().subscribers(), 1U);
  }
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (stats().subscribers() > 0 && std::chrono::steady_clock::now() < deadline) {
    // Nothing comes; this keeps the questions below the rate limit.
    ASSERT_TRUE(client().next_event(std::chrono::milliseconds(30)).ok());
  }
  EXPECT_EQ(stats().subscribers(), 0U);
  ASSERT_TRUE(client().step("w", 20).ok());
  EXPECT_NEAR(stats().soft_bodies(0).centre_of_mass().y(), stats().soft_bodies(1).centre_of_mass().y(), 1e-6);
}

}  // namespace
}  // namespace pneuma::integration
