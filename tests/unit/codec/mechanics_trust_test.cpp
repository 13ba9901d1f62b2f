// Shows when a body is predicted by its mechanics: at once where they do better, for a run of frames where they nearly
// do, and never for long where they do not; and that a writer whose body's velocities are not known at first comes to
// them by its first frame's moves, or by such a run.
#include "codec/mechanics_trust.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "codec/frame_codec.h"
#include "unit/codec/meshes.h"

namespace pneuma::codec {
namespace {

/// The frames of `count` that go by the mechanics, and how many of these without a look at the moves.
struct Taken {
  std::uint32_t all = 0;
  std::uint32_t unseen = 0;
};
Taken take(MechanicsTrust& trust, std::uint32_t count, std::uint32_t level, double moves_level) {
  Taken taken;
  for (std::uint32_t frame = 0; frame < count; ++frame) {
    const bool is_unseen = trust.take_unseen(level);
    if (is_unseen) ++taken.unseen;
    if (is_unseen || trust.take(level, moves_level)) ++taken.all;
  }
  return taken;
}

/// Of a body that was not at rest, after its first frame.
MechanicsTrust begun() {
  MechanicsTrust trust;
  EXPECT_FALSE(trust.take_unseen(0));
  EXPECT_FALSE(trust.take(10, 9.0 + MechanicsTrust::at_rest_levels));
  return trust;
}

TEST(MechanicsTrust, TakesMechanicsAtOnceOfABodyThatWasAtRest) {
  MechanicsTrust trust;
  EXPECT_FALSE(trust.take_unseen(0));
  EXPECT_TRUE(trust.take(10, 10.0 + MechanicsTrust::at_rest_levels));
  EXPECT_TRUE(trust.take_unseen(10));
}

TEST(MechanicsTrust, LooksAtTheMovesOnlyNowAndThenWhereMechanicsDoBetter) {
  MechanicsTrust trust = begun();
  constexpr std::uint32_t rounds = 5;
  constexpr std::uint32_t round_frames = MechanicsTrust::unseen_frames + 1;
  const Taken taken = take(trust, rounds * round_frames, 10, 11.0);
  EXPECT_EQ(taken.all, rounds * round_frames);
  EXPECT_EQ(taken.unseen, rounds * MechanicsTrust::unseen_frames);
}

TEST(MechanicsTrust, LooksAgainWhereTheLevelRises) {
  MechanicsTrust trust = begun();
  ASSERT_TRUE(trust.take(10, 20.0));
  EXPECT_FALSE(trust.take_unseen(10 + MechanicsTrust::unseen_rise + 1));
  EXPECT_TRUE(trust.take_unseen(10 + MechanicsTrust::unseen_rise));
  EXPECT_TRUE(trust.take_unseen(4));
  EXPECT_FALSE(trust.take_unseen(10)) << "it has been as low as 4 since";
}

TEST(MechanicsTrust, GivesUpWhereMovesDoMuchBetter) {
  MechanicsTrust trust = begun();
  ASSERT_TRUE(trust.take(10, 20.0));
  EXPECT_EQ(take(trust, 1'000, 10, 10.0 - MechanicsTrust::close_levels).all, MechanicsTrust::unseen_frames)
      << "none after it has looked";
}

TEST(MechanicsTrust, TriesARunAndPausesWhereMovesDoALittleBetter) {
  constexpr std::uint32_t cycle = MechanicsTrust::run_frames + MechanicsTrust::pause_frames;
  MechanicsTrust trust = begun();
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(take(trust, MechanicsTrust::run_frames, 10, 9.0).all, MechanicsTrust::run_frames) << "one run";
    EXPECT_EQ(take(trust, MechanicsTrust::pause_frames, 10, 9.0).all, 0U);
  }
  EXPECT_EQ(take(trust, 10 * cycle, 10, 9.0).all, 10 * MechanicsTrust::run_frames);
}

TEST(MechanicsTrust, RunEndsWhereMovesDoMuchBetter) {
  MechanicsTrust trust = begun();
  EXPECT_EQ(take(trust, 3, 10, 9.0).all, 3U);
  EXPECT_FALSE(trust.take(10, 10.0 - MechanicsTrust::close_levels));
  EXPECT_EQ(take(trust, MechanicsTrust::pause_frames, 10, 9.0).all, 0U) << "it pauses";
  EXPECT_EQ(take(trust, 100, 10, 9.0).all, 2 * MechanicsTrust::run_frames) << "a whole one, a pause, and one more";
}

TEST(MechanicsTrust, WinEndsAPauseAndEarnsANewRun) {
  MechanicsTrust trust = begun();
  take(trust, MechanicsTrust::run_frames, 10, 9.0);
  ASSERT_FALSE(trust.take(10, 9.0)) << "it pauses";
  EXPECT_TRUE(trust.take(10, 11.0));
  EXPECT_FALSE(trust.take_unseen(20));
  EXPECT_EQ(take(trust, MechanicsTrust::run_frames, 20, 19.0).all, MechanicsTrust::run_frames);
}

/// A sheet whose springs are not at rest, as its mechanics have it on a grid 64 times finer than a stream's.
class TremblingSheet {
 public:
  explicit TremblingSheet(double max_error_m) : step_m_(grid_step_m(max_error_m)) {
    mechanics_.frame_s = 1.0 / 60.0;
    mechanics_.substeps = 8;
    mechanics_.masses_kg = {0.1F};
    mechanics_.stiffnesses_n_m = {10.0F};
    const auto place_of = [](std::uint32_t vertex) {
      const std::uint32_t row = vertex / columns;
      return std::array{static_cast<double>(vertex % columns), static_cast<double>(row)};
    };
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> stretch(0.9, 1.1);
    for (const auto& [a, b] : spring_edges(*order_)) {
      const auto [ax, az] = place_of(order_->vertices[a]);
      const auto [bx, bz] = place_of(order_->vertices[b]);
      const double length_m = spacing_m * std::hypot(ax - bx, az - bz);
      mechanics_.rest_lengths_m.push_back(static_cast<float>(length_m * stretch(random)));
    }
    truth_ = simulation(step_m_ / 64.0);
    for (const std::uint32_t vertex : order_->vertices) {
      const auto [x, z] = place_of(vertex);
      for (const double place : {x, 0.0, z}) {
        points_.push_back(std::llround(64.0 * spacing_m / step_m_ * place));
      }
    }
  }

  [[nodiscard]] const MeshOrderPtr& order() const { return order_; }
  [[nodiscard]] SimulatedMotionPtr simulation() const { return simulation(step_m_); }
  [[nodiscard]] std::vector<double> positions_m() const {
    std::vector<double> positions_m(points_.size());
    for (std::size_t i = 0; i < points_.size(); ++i) {
      positions_m[3 * order_->vertices[i / 3] + i % 3] = static_cast<double>(points_[i]) * step_m_ / 64.0;
    }
    return positions_m;
  }
  void advance() {
    std::vector<Lanes> drift;
    truth_->predict(points_, velocities_, drift);
    for (Lanes& lanes : drift) lanes.v = shifted_down(lanes.v, fraction_bits);
    truth_->correct(drift, velocities_);
    for (std::size_t i = 0; i < points_.size(); ++i) points_[i] += static_cast<std::int32_t>(drift[i / 3].v[i % 3]);
  }

 private:
  static constexpr std::uint32_t columns = 16;
  static constexpr double spacing_m = 0.1;

  [[nodiscard]] SimulatedMotionPtr simulation(double step_m) const {
    EXPECT_TRUE(SimulatedMotion::check(*order_, mechanics_, step_m).ok());
    return std::make_shared<SimulatedMotion>(order_, sheet(columns, columns), mechanics_, step_m);
  }

  double step_m_;
  MeshOrderPtr order_ = sheet_order(columns, columns);
  Mechanics mechanics_;
  SimulatedMotionPtr truth_;
  Lattice points_;
  std::vector<Lanes> velocities_ = std::vector<Lanes>(order_->size());
};

struct Written {
  std::size_t bytes = 0;
  bool is_first_simulated = false;
  std::size_t simulated_frames = 0;
};

/// Frames of a stream that begins in the midst of the sheet's motion.
Written write_midway(double max_error_m, bool has_mechanics) {
  constexpr int frames_before = 40;
  constexpr int frames = 120;
  TremblingSheet sheet(max_error_m);
  for (int frame = 0; frame < frames_before; ++frame) sheet.advance();
  FrameWriter writer({sheet.order()}, max_error_m, {has_mechanics ? sheet.simulation() : nullptr});
  writer.place_body(0, sheet.positions_m());
  Written written;
  for (int frame = 0; frame < frames; ++frame) {
    sheet.advance();
    std::string payload;
    writer.begin_delta();
    writer.move_body(0, sheet.positions_m());
    writer.take_delta(payload);
    written.bytes += payload.size();
    const bool is_simulated = payload.at(1) == static_cast<char>(BlockMode::simulated);
    if (is_simulated) ++written.simulated_frames;
    if (frame == 0) written.is_first_simulated = is_simulated;
  }
  return written;
}

// Within so coarse a bound a frame's moves say too little of velocities for mechanics to do better at once.
TEST(MechanicsTrust, WriterComesToMechanicsByARun) {
  const Written written = write_midway(1e-3, true);
  EXPECT_GE(written.simulated_frames, 110U);
  EXPECT_LT(10 * written.bytes, 9 * write_midway(1e-3, false).bytes);
}

// A fine bound is the other way about: mechanics that begin at rest would take long to come to the velocities that one
// frame's moves tell.
TEST(MechanicsTrust, WriterTakesVelocitiesFromAFirstFramesMoves) {
  const Written written = write_midway(1e-5, true);
  EXPECT_FALSE(written.is_first_simulated);
  EXPECT_GE(written.simulated_frames, 110U);
  EXPECT_LT(10 * written.bytes, 6 * write_midway(1e-5, false).bytes);
}

}  // namespace
}  // namespace pneuma::codec
