// Shows, on every frame of every built-in scene, that velocities are within the bound that their stream declares, that
// a coarser stream has its vertices where they are, that a filtered one decodes to the same points as the whole, and
// that a simulated one is within its bound and the same for who joins late.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "app/frame_hub.h"
#include "pneuma_client/frames.h"
#include "support/recording.h"
#include "unit/app/viewer.h"

namespace pneuma {
namespace {

constexpr int ticks = 120;

/// One subscriber and its decoder.
class Stream {
 public:
  Stream(app::FrameHub& hub, net::SessionId session, double rate_hz, const v1::Subscribe& request) : viewer_(session) {
    const auto subscribed = hub.subscribe(viewer_.session(), request, rate_hz);
    EXPECT_TRUE(subscribed.ok());
    subscribed_ = *subscribed;
    EXPECT_TRUE(decoder_.add_stream(subscribed_).ok());
  }

  [[nodiscard]] const v1::Subscribed& subscribed() const { return subscribed_; }

  client::DecodedFrame next(const app::Outbox& outbox) {
    std::optional<client::DecodedFrame> last;
    for (const std::string& bytes : viewer_.take(outbox)) {
      v1::ServerMessage message;
      EXPECT_TRUE(message.ParseFromString(bytes));
      if (message.has_topology()) {
        EXPECT_TRUE(decoder_.take_topology(message.topology()).ok());
      }
      if (message.has_layout()) {
        EXPECT_TRUE(decoder_.take_layout(message.layout()).ok());
      }
      if (!message.has_frame()) continue;
      auto frame = decoder_.take_frame(message.frame(), 0);
      EXPECT_TRUE(frame.ok()) << frame.status().message();
      if (frame.ok()) last = std::move(*frame);
    }
    EXPECT_TRUE(last);
    return last.value_or(client::DecodedFrame());
  }

 private:
  app::Viewer viewer_;
  client::StreamDecoder decoder_;
  v1::Subscribed subscribed_;
};

/// Over the vertices kept; all where none is named.
double furthest(const std::vector<double>& seen, const std::vector<double>& truth,
                const std::vector<std::uint32_t>& kept) {
  double furthest = 0.0;
  for (std::size_t at = 0; 3 * at < seen.size(); ++at) {
    const double* const a = &seen[3 * at];
    const double* const b = &truth[3 * (kept.empty() ? at : kept[at])];
    furthest = std::max(furthest, std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
  }
  return furthest;
}

class StreamOfBuiltInScene : public testing::TestWithParam<std::string> {};

TEST_P(StreamOfBuiltInScene, HoldsWhatItDeclares) {
  physics::World world = support::world_of(GetParam());
  const double rate_hz = 1.0 / world.tick_period_s();
  std::uint32_t last_stream_id = 0;
  app::FrameHub hub([&] { return ++last_stream_id; }, [](std::uint32_t) {});
  v1::Subscribe request;
  Stream whole(hub, 1, rate_hz, request);
  request.add_bodies(world.soft_body(world.soft_body_count() - 1).name);
  Stream filtered(hub, 2, rate_hz, request);
  request.clear_bodies();
  request.set_velocities(true);
  request.set_level_of_detail(1);
  Stream coarse(hub, 3, rate_hz, request);
  request.set_level_of_detail(0);
  Stream moving(hub, 4, rate_hz, request);
  request.set_velocities(false);
  request.set_simulated(true);
  Stream simulated(hub, 5, rate_hz, request);
  std::optional<Stream> late;

  physics::Workers workers{1};
  for (int tick = 1; tick <= ticks; ++tick) {
    world.step_tick(workers);
    app::Outbox outbox;
    hub.encode_tick(app::LiveFrames(world), world.tick(), false, outbox);
    const client::DecodedFrame all = whole.next(outbox);
    const client::DecodedFrame one = filtered.next(outbox);
    const client::DecodedFrame fast = moving.next(outbox);
    const client::DecodedFrame few = coarse.next(outbox);
    const client::DecodedFrame foreseen = simulated.next(outbox);
    if (late) {
      const client::DecodedFrame same = late->next(outbox);
      for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
        ASSERT_EQ(same.bodies[i].positions_m, foreseen.bodies[i].positions_m) << "tick " << tick;
      }
    }
    if (tick == ticks / 2) late.emplace(hub, 6, rate_hz, request);
    ASSERT_EQ(one.bodies.size(), 1U);
    ASSERT_EQ(one.bodies[0].positions_m, all.bodies.back().positions_m) << "tick " << tick;
    for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
      std::vector<double> true_m(3 * world.soft_body(i).mesh->positions_m.size());
      std::vector<double> true_m_s(true_m.size());
      world.copy_positions(i, true_m);
      world.copy_velocities(i, true_m_s);
      ASSERT_LE(furthest(foreseen.bodies[i].positions_m, true_m, {}), simulated.subscribed().max_error_m());
      ASSERT_EQ(fast.bodies[i].velocities_m_s.size(), true_m_s.size());
      ASSERT_LE(furthest(fast.bodies[i].velocities_m_s, true_m_s, {}), moving.subscribed().max_velocity_error_m_s());
      const client::SoftBodyFrame& body = few.bodies[i];
      ASSERT_LE(furthest(body.positions_m, true_m, *body.kept_vertices), coarse.subscribed().max_error_m());
      ASSERT_LE(furthest(body.velocities_m_s, true_m_s, *body.kept_vertices),
                coarse.subscribed().max_velocity_error_m_s());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Streams, StreamOfBuiltInScene, testing::ValuesIn(scene_io::builtin_scene_names()),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace pneuma
