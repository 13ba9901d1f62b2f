// Shows that the fitted weights are those that a motion was made with, that a few vertices that hit something do not
// decide for all, and that weights are left alone where new ones would not pay.
#include "codec/prediction_fit.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "unit/codec/meshes.h"

namespace pneuma::codec {
namespace {

template <typename Distribution>
Lanes drawn_lanes(Distribution& distribution, std::mt19937_64& random) {
  const auto lane = [&] { return static_cast<std::uint32_t>(std::lround(distribution(random))); };
  return {LaneVector{lane(), lane(), lane(), 0}};
}

constexpr std::uint32_t columns = 40;
constexpr DriftWeights made_with{.own = {230, -120, 30, -10}, .ring = {90, -40, 0, 0}, .ring_of_ring = 12};

/// A sheet that moved at random for some frames, and then by made_with, to a step.
class PredictionFit : public ::testing::Test {
 protected:
  PredictionFit() {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> move(-1'000.0, 1'000.0);
    for (std::size_t k = 0; k < history_size; ++k) {
      for (std::size_t slot = 0; slot < order_->size(); ++slot) {
        history_[k].push_back(drawn_lanes(move, random));
      }
      ring_differences(*order_, history_[k], rings_.of_moves[k]);
    }
    ring_differences(*order_, rings_.of_moves[0], rings_.of_ring);
    std::vector<Lanes> ring = rings_.of_moves[0];
    std::vector<Lanes> drift;
    predict_drift(*order_, history_, made_with, ring, drift);
    for (const Lanes& lanes : drift) moves_.push_back({shifted_down(lanes.v, fraction_bits)});
  }

  [[nodiscard]] std::optional<DriftWeights> fit(const DriftWeights& last) const {
    return better_weights(*order_, moves_, history_, rings_, last);
  }

  std::shared_ptr<const MeshOrder> order_ = sheet_order(columns, columns);
  MoveHistory history_;
  RingHistory rings_{order_->size()};
  std::vector<Lanes> moves_;
};

void expect_near(const DriftWeights& a, const DriftWeights& b, std::int32_t units) {
  for (std::size_t k = 0; k < history_size; ++k) {
    EXPECT_NEAR(a.own[k], b.own[k], units) << k;
    EXPECT_NEAR(a.ring[k], b.ring[k], units) << k;
  }
  EXPECT_NEAR(a.ring_of_ring, b.ring_of_ring, units);
}

TEST_F(PredictionFit, FindsTheWeightsOfAMotion) {
  const auto fitted = fit({});
  ASSERT_TRUE(fitted);
  expect_near(*fitted, made_with, 1);
}

TEST_F(PredictionFit, LeavesWeightsThatNothingBeats) {
  EXPECT_FALSE(fit(made_with));
}

TEST_F(PredictionFit, FewVerticesThatHitSomethingDoNotDecideForAll) {
  const std::vector<Lanes> undisturbed = moves_;
  DriftWeights last = made_with;
  last.own[0] -= 32;
  for (const double push_steps : {4'000.0, 16'000.0, 32'000.0}) {
    SCOPED_TRACE(push_steps);
    std::mt19937_64 random(12);
    std::bernoulli_distribution is_hit(0.1);
    std::uniform_real_distribution<double> push(-push_steps, push_steps);
    moves_ = undisturbed;
    for (Lanes& move : moves_) {
      if (is_hit(random)) move.v += drawn_lanes(push, random).v;
    }
    const auto fitted = fit(last);
    ASSERT_TRUE(fitted);
    expect_near(*fitted, made_with, 12);
  }
}

}  // namespace
}  // namespace pneuma::codec
