// Shows what a stream is for a client that simulates: that its layout tells the bodies' mechanics, again where they are
// edited, that its frames take fewer bytes, and that they are within the bound whatever else moves the bodies. A real
// world and the client's own decoder, no sockets.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "app/frame_hub.h"
#include "app/live_world.h"
#include "app/mechanics.h"
#include "app/mesh_topologies.h"
#include "ball_scene.h"
#include "pneuma_client/frames.h"
#include "viewer.h"

namespace pneuma::app {
namespace {

constexpr double simulated_error_m = 1e-4;

/// A subscriber with its decoder, and what came.
struct Simulator {
  explicit Simulator(net::SessionId id) : viewer(id) {}

  Viewer viewer;
  client::StreamDecoder decoder;
  std::vector<v1::Layout> layouts;
  std::optional<client::DecodedFrame> last;
  std::size_t bytes = 0;  // of frames that are not keys
};

class SimulatedStream : public testing::Test {
 protected:
  SimulatedStream()
      : world_(std::move(*LiveWorld::create(ball_scene()))),
        hub_([this] { return ++last_stream_id_; }, [](std::uint32_t) {}) {}

  void subscribe(Simulator& watcher, bool simulated, bool time_layers = false, std::uint32_t level = 0) {
    v1::Subscribe request;
    request.set_world("w");
    request.set_max_error_m(simulated_error_m);
    request.set_simulated(simulated);
    request.set_time_layers(time_layers);
    request.set_level_of_detail(level);
    const auto subscribed = hub_.subscribe(watcher.viewer.session(), request, 60.0);
    ASSERT_TRUE(subscribed.ok()) << subscribed.status().message();
    ASSERT_TRUE(watcher.decoder.add_stream(*subscribed).ok());
  }

  void change(const v1::ClientMessage& message) {
    const auto effect = world_.change(message);
    ASSERT_TRUE(effect.ok()) << effect.status().message();
    if (effect->edited) hub_.edited();
  }

  void set_gravity(double y_m_s2) {
    v1::ClientMessage edit;
    edit.mutable_edit()->set_world("w");
    edit.mutable_edit()->mutable_edit()->add_changes()->mutable_set_gravity()->set_y(y_m_s2);
    change(edit);
  }

  void run(int ticks, const std::vector<Simulator*>& watchers) {
    for (int tick = 0; tick < ticks; ++tick) {
      world_.physics().step_tick(workers_);
      Outbox outbox;
      hub_.encode_tick(LiveFrames(world_.physics()), world_.tick(), false, outbox);
      for (Simulator* const watcher : watchers) see(*watcher, outbox);
    }
  }

  static void see(Simulator& watcher, const Outbox& outbox) {
    for (const std::string& bytes : watcher.viewer.take(outbox)) {
      v1::ServerMessage message;
      ASSERT_TRUE(message.ParseFromString(bytes));
      if (message.has_topology()) {
        ASSERT_TRUE(watcher.decoder.take_topology(message.topology()).ok());
      }
      if (message.has_layout()) {
        watcher.layouts.push_back(message.layout());
        ASSERT_TRUE(watcher.decoder.take_layout(message.layout()).ok());
      }
      if (!message.has_frame()) continue;
      if (message.frame().has_base_tick()) watcher.bytes += bytes.size();
      auto frame = watcher.decoder.take_frame(message.frame(), bytes.size());
      ASSERT_TRUE(frame.ok()) << frame.status().message();
      watcher.last = std::move(*frame);
    }
  }

  void expect_true_places(const Simulator& watcher) const {
    ASSERT_TRUE(watcher.last);
    const physics::World& world = world_.physics();
    for (std::size_t body = 0; body < world.soft_body_count(); ++body) {
      const std::vector<double>& seen_m = watcher.last->bodies.at(body).positions_m;
      std::vector<double> true_m(seen_m.size());
      world.copy_positions(body, true_m);
      for (std::size_t i = 0; i < seen_m.size(); i += 3) {
        const double off_m =
            std::hypot(seen_m[i] - true_m[i], seen_m[i + 1] - true_m[i + 1], seen_m[i + 2] - true_m[i + 2]);
        ASSERT_LE(off_m, simulated_error_m);
      }
    }
  }

  LiveWorld world_;
  physics::Workers workers_{1};
  std::uint32_t last_stream_id_ = 0;
  FrameHub hub_;
};

TEST_F(SimulatedStream, TakesFewerBytesThanAnyOther) {
  Simulator plain(1);
  Simulator simulated(2);
  subscribe(plain, false);
  subscribe(simulated, true);
  EXPECT_EQ(hub_.class_count(), 2U);
  run(60, {&plain, &simulated});
  expect_true_places(simulated);
  EXPECT_LT(static_cast<double>(simulated.bytes), 0.8 * static_cast<double>(plain.bytes));
  ASSERT_EQ(simulated.layouts.size(), 1U);
  const v1::Layout::Soft& ball = simulated.layouts[0].soft_bodies(0);
  ASSERT_TRUE(ball.has_mechanics());
  EXPECT_DOUBLE_EQ(ball.mechanics().frame_s(), 1.0 / 60.0);
  EXPECT_EQ(ball.mechanics().rest_lengths_m_size(), 120);
  EXPECT_EQ(ball.mechanics().planes_size(), 1);
  EXPECT_FALSE(plain.layouts.at(0).soft_bodies(0).has_mechanics());
}

TEST_F(SimulatedStream, IsWithinItsBoundWhateverMovesTheBodies) {
  Simulator watcher(1);
  subscribe(watcher, true);
  for (int round = 0; round < 6; ++round) {
    if (round == 1) change(impulse_up("ball", 3.0));
    if (round == 2) change(grab_vertex(5));
    if (round == 3) change(add_second_ball());
    if (round == 4) change(impulse_up("second", -20.0));
    for (int tick = 0; tick < 10; ++tick) {
      run(1, {&watcher});
      ASSERT_NO_FATAL_FAILURE(expect_true_places(watcher)) << "round " << round << ", tick " << tick;
    }
  }
}

TEST_F(SimulatedStream, TellsMechanicsAgainWhereTheyAreEdited) {
  Simulator plain(1);
  Simulator simulated(2);
  subscribe(plain, false);
  subscribe(simulated, true);
  run(3, {&plain, &simulated});
  set_gravity(-1.5);
  run(60, {&plain, &simulated});
  EXPECT_EQ(plain.layouts.size(), 1U);
  ASSERT_EQ(simulated.layouts.size(), 2U);
  EXPECT_EQ(simulated.layouts[1].soft_bodies(0).mechanics().gravity_m_s2().y(), -1.5);
  EXPECT_GT(simulated.layouts[1].layout_id(), simulated.layouts[0].layout_id());
  expect_true_places(simulated);
}

TEST_F(SimulatedStream, IsToldOfMechanicsOnceASecondAtMost) {
  Simulator watcher(1);
  subscribe(watcher, true);
  run(1, {&watcher});
  for (int edits = 1; edits <= 120; ++edits) {
    set_gravity(-0.125 * edits);
    run(1, {&watcher});
    ASSERT_NO_FATAL_FAILURE(expect_true_places(watcher)) << edits;
  }
  EXPECT_EQ(watcher.layouts.size(), 3U);
  set_gravity(-2.5);
  run(60, {&watcher});
  ASSERT_EQ(watcher.layouts.size(), 4U);
  EXPECT_EQ(watcher.layouts[3].soft_bodies(0).mechanics().gravity_m_s2().y(), -2.5);
  run(180, {&watcher});
  EXPECT_EQ(watcher.layouts.size(), 4U) << "nothing was edited";
}

TEST_F(SimulatedStream, HasABodyThatIsAddedAtOnceAndItsMechanicsWithinASecond) {
  Simulator watcher(1);
  subscribe(watcher, true);
  run(3, {&watcher});
  change(add_second_ball());
  run(1, {&watcher});
  ASSERT_EQ(watcher.layouts.size(), 2U);
  ASSERT_EQ(watcher.layouts[1].soft_bodies_size(), 2);
  EXPECT_TRUE(watcher.layouts[1].soft_bodies(0).has_mechanics()) << "as it was";
  EXPECT_FALSE(watcher.layouts[1].soft_bodies(1).has_mechanics());
  run(60, {&watcher});
  ASSERT_EQ(watcher.layouts.size(), 3U);
  EXPECT_TRUE(watcher.layouts[2].soft_bodies(1).has_mechanics());
  expect_true_places(watcher);
}

TEST_F(SimulatedStream, GoesOnAfterAReset) {
  Simulator watcher(1);
  subscribe(watcher, true);
  run(70, {&watcher});
  v1::ClientMessage reset;
  reset.mutable_reset()->set_world("w");
  change(reset);
  for (int tick = 0; tick < 70; ++tick) {
    run(1, {&watcher});
    ASSERT_NO_FATAL_FAILURE(expect_true_places(watcher)) << tick;
  }
  ASSERT_EQ(watcher.layouts.size(), 1U);
  EXPECT_TRUE(watcher.layouts[0].soft_bodies(0).has_mechanics());
}

TEST_F(SimulatedStream, OffersNoMoreThanItsWork) {
  // Balls of 42 vertices and 80 faces over a floor.
  const LiveFrames source(world_.physics());
  MeshTopologies topologies([](std::size_t /*vertices*/, const auto& make) { make(); });
  const auto topology = topologies.find(source.mesh(0), 0);
  const auto work_of = [](const codec::Mechanics& own) {
    return codec::simulated_work(own.substeps, 42, 80, own.planes.size());
  };
  MechanicsTerms terms{.frame_s = 1.0 / 60.0, .grid_step_m = simulated_error_m, .work_left = offered_work_max};
  const auto mechanics = source.mechanics(0, *topology->order, terms);
  ASSERT_TRUE(mechanics);
  const std::uint64_t work = work_of(*mechanics);
  EXPECT_EQ(terms.work_left, offered_work_max - work);
  terms.work_left = work;
  EXPECT_TRUE(source.mechanics(0, *topology->order, terms));
  EXPECT_EQ(terms.work_left, 0U);
  terms.work_left = work - 1;
  EXPECT_FALSE(source.mechanics(0, *topology->order, terms));
  EXPECT_LT(terms.work_left, work - 1) << "it took an estimate";
  terms.work_left = 1;
  EXPECT_FALSE(source.mechanics(0, *topology->order, terms));
  EXPECT_EQ(terms.work_left, 1U) << "nothing was tried";
}

TEST_F(SimulatedStream, OfALevelOfDetailIsAsAnyOther) {
  Simulator watcher(1);
  Simulator other(2);
  subscribe(watcher, true, false, 1);
  subscribe(other, false, false, 1);
  EXPECT_EQ(hub_.class_count(), 1U);
  run(2, {&watcher});
  EXPECT_GT(watcher.layouts.at(0).soft_bodies(0).kept_vertices_size(), 0);
  EXPECT_FALSE(watcher.layouts.at(0).soft_bodies(0).has_mechanics());
}

TEST_F(SimulatedStream, InTimeLayersIsAsAnyOther) {
  Simulator watcher(1);
  Simulator other(2);
  subscribe(watcher, true, true);
  subscribe(other, false, true);
  EXPECT_EQ(hub_.class_count(), 1U);
  run(2, {&watcher});
  EXPECT_FALSE(watcher.layouts.at(0).soft_bodies(0).has_mechanics());
}

}  // namespace
}  // namespace pneuma::app
