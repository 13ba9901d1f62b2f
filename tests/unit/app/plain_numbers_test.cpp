// Shows that plain numbers are what a reader without a codec makes of them, within the error asked for, and that a
// plain stream stands on no frame before.
#include "app/plain_numbers.h"

#include <cmath>
#include <cstring>
#include <random>

#include <gtest/gtest.h>

#include "app/frame_hub.h"
#include "app/live_world.h"
#include "app/stream_terms.h"
#include "ball_scene.h"
#include "viewer.h"

namespace pneuma::app {
namespace {

template <class Number>
std::vector<double> numbers_of(const std::string& bytes) {
  std::vector<double> numbers(bytes.size() / sizeof(Number));
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    Number number{};
    std::memcpy(&number, bytes.data() + i * sizeof number, sizeof number);
    numbers[i] = static_cast<double>(number);
  }
  return numbers;
}

/// As WIRE.md says.
std::vector<double> read_plain(const v1::Frame& frame) {
  if (!frame.has_int16()) return numbers_of<float>(frame.payload());
  std::vector<double> numbers = numbers_of<std::int16_t>(frame.payload());
  const v1::Vec3& origin = frame.int16().origin();
  const std::array<double, 3> from{origin.x(), origin.y(), origin.z()};
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = from[i % 3] + frame.int16().step_m() * numbers[i];
  return numbers;
}

double error_of(const std::vector<double>& a, const std::vector<double>& b, std::size_t vertex) {
  return std::hypot(a[3 * vertex] - b[3 * vertex], a[3 * vertex + 1] - b[3 * vertex + 1],
                    a[3 * vertex + 2] - b[3 * vertex + 2]);
}

TEST(PlainNumbers, SixteenBitsKeepTheErrorWhereverTheyAreUsed) {
  std::mt19937_64 random(20);
  for (int round = 0; round < 300; ++round) {
    const double max_error_m = std::pow(10.0, -6.0 + 7.0 * static_cast<double>(round) / 300.0);
    const double extent_m = max_error_m * std::pow(10.0, std::uniform_real_distribution<double>(0.0, 5.5)(random));
    const double place_m = std::uniform_real_distribution<double>(-100.0, 100.0)(random);
    std::uniform_real_distribution<double> spread(place_m - 0.5 * extent_m, place_m + 0.5 * extent_m);
    std::vector<double> wanted(3 * 50);
    for (double& number : wanted) number = spread(random);
    v1::Frame frame;
    const auto grid = int16_grid(wanted, max_error_m);
    // 65,534 steps of 2 / sqrt(3) errors hold what is no wider than 75,672 of them.
    EXPECT_TRUE(grid || extent_m >= 75'000.0 * max_error_m) << extent_m / max_error_m;
    if (!grid) continue;
    *frame.mutable_int16() = *grid;
    append_int16(wanted, grid->origin(), grid->step_m(), *frame.mutable_payload());
    const std::vector<double> found = read_plain(frame);
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < 50; ++i) EXPECT_LE(error_of(found, wanted, i), max_error_m);
  }
}

TEST(PlainNumbers, FloatsAndDoublesComeBack) {
  const std::vector<double> wanted{1.5, -0.25, 1e6, 0.0, 3.0, -7.5};
  for (const bool double_precision : {false, true}) {
    std::string bytes;
    append_numbers(wanted, double_precision, bytes);
    EXPECT_EQ(bytes.size(), wanted.size() * (double_precision ? 8 : 4));
    EXPECT_EQ(*read_numbers(bytes, double_precision, "f"), wanted);
    bytes.pop_back();
    EXPECT_EQ(read_numbers(bytes, double_precision, "f").status().code(), base::StatusCode::invalid_argument);
  }
}

class PlainStream : public testing::Test {
 protected:
  PlainStream() : world_(std::move(*LiveWorld::create(ball_scene()))), hub_([] { return 5U; }, [](std::uint32_t) {}) {
    request_.set_world("w");
    request_.set_encoding(v1::Subscribe::PLAIN);
    request_.set_velocities(true);
  }

  std::vector<v1::Frame> tick() {
    world_.physics().step_tick(workers_);
    Outbox outbox;
    hub_.encode_tick(LiveFrames(world_.physics()), world_.tick(), false, outbox);
    std::vector<v1::Frame> frames;
    for (const std::string& bytes : viewer_.take(outbox)) {
      v1::ServerMessage message;
      EXPECT_TRUE(message.ParseFromString(bytes));
      if (message.has_frame()) frames.push_back(message.frame());
    }
    return frames;
  }

  std::vector<double> positions() const {
    std::vector<double> x(3 * world_.physics().soft_body(0).mesh->positions_m.size());
    world_.physics().copy_positions(0, x);
    return x;
  }

  LiveWorld world_;
  FrameHub hub_;
  physics::Workers workers_{1};
  Viewer viewer_{7};
  v1::Subscribe request_;
};

TEST_F(PlainStream, TellsFloatsInFramesThatStandAlone) {
  ASSERT_TRUE(hub_.subscribe(viewer_.session(), request_, 60.0).ok());
  for (int i = 0; i < 5; ++i) {
    const std::vector<v1::Frame> frames = tick();
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_FALSE(frames[0].has_base_tick());
    EXPECT_FALSE(frames[0].has_int16());
    EXPECT_EQ(frames[0].poses_size(), 1) << "all solids";
    const std::vector<double> found = read_plain(frames[0]);
    const std::vector<double> wanted = positions();
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t n = 0; n < found.size(); ++n)
      EXPECT_EQ(found[n], static_cast<double>(static_cast<float>(wanted[n])));
    EXPECT_EQ(frames[0].velocities().size(), frames[0].payload().size());
  }
}

TEST_F(PlainStream, TellsSixteenBitsWithinAnErrorThatIsAskedFor) {
  request_.set_max_error_m(1e-4);
  const auto subscribed = hub_.subscribe(viewer_.session(), request_, 60.0);
  ASSERT_TRUE(subscribed.ok());
  EXPECT_EQ(subscribed->max_error_m(), 1e-4);
  EXPECT_EQ(subscribed->grid_step_m(), 0.0);
  const std::vector<v1::Frame> frames = tick();
  ASSERT_EQ(frames.size(), 1U);
  ASSERT_TRUE(frames[0].has_int16());
  EXPECT_EQ(frames[0].payload().size(), 2 * positions().size());
  const std::vector<double> found = read_plain(frames[0]);
  for (std::size_t i = 0; i < found.size() / 3; ++i) EXPECT_LE(error_of(found, positions(), i), 1e-4);
  const double fall_m_s = -9.81 / 60.0;
  const std::vector<double> velocities = numbers_of<std::int16_t>(frames[0].velocities());
  double mean_m_s = 0.0;
  for (std::size_t i = 1; i < velocities.size(); i += 3)
    mean_m_s += frames[0].int16().velocity_step_m_s() * velocities[i];
  EXPECT_NEAR(mean_m_s / (static_cast<double>(velocities.size()) / 3.0), fall_m_s,
              subscribed->max_velocity_error_m_s());
}

TEST_F(PlainStream, ReadersOfTheSameShareAndOthersDoNot) {
  Viewer second(8);
  Viewer third(9);
  ASSERT_TRUE(hub_.subscribe(viewer_.session(), request_, 60.0).ok());
  ASSERT_TRUE(hub_.subscribe(second.session(), request_, 60.0).ok());
  EXPECT_EQ(hub_.class_count(), 1U);
  v1::Subscribe coded = request_;
  coded.set_encoding(v1::Subscribe::ERROR_BOUNDED);
  ASSERT_TRUE(hub_.subscribe(third.session(), coded, 60.0).ok());
  EXPECT_EQ(hub_.class_count(), 2U);
}

TEST_F(PlainStream, RefusesWhatDoesNotGoTogetherAndWhatNoNetworkTakes) {
  v1::Subscribe layered = request_;
  layered.set_time_layers(true);
  EXPECT_EQ(check_terms(layered).where(), "subscribe.time_layers");
  v1::Subscribe adaptive = request_;
  adaptive.set_adaptive(true);
  EXPECT_EQ(check_terms(adaptive).where(), "subscribe.adaptive");
  v1::Scene large = ball_scene();
  large.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(6);
  large.mutable_stepping()->set_rate_hz(1000.0);
  large.mutable_stepping()->set_substeps(1);
  const auto world = LiveWorld::create(large);
  ASSERT_TRUE(world.ok()) << world.status().message();
  const base::Status refused = check_subscribed(request_, LiveFrames(world->physics()));
  EXPECT_EQ(refused.code(), base::StatusCode::limit_exceeded);
  EXPECT_EQ(refused.where(), "subscribe.encoding");
  v1::Subscribe seldom = request_;
  seldom.set_rate_hz(30.0);
  EXPECT_TRUE(check_subscribed(seldom, LiveFrames(world->physics())).ok());
  v1::Subscribe coded = request_;
  coded.set_encoding(v1::Subscribe::ERROR_BOUNDED);
  EXPECT_TRUE(check_subscribed(coded, LiveFrames(world->physics())).ok());
}

}  // namespace
}  // namespace pneuma::app
