// Shows that features that stop each other keep their momentum and gain no energy.
#include "physics/contact/stopped_features.h"

#include <random>

#include <gtest/gtest.h>

namespace pneuma::physics {
namespace {

Vec3d any_velocity(std::mt19937& random) {
  std::uniform_real_distribution<double> along(-3.0, 3.0);
  const double x = along(random);
  const double y = along(random);
  return {x, y, along(random)};
}

double kinetic_j(const StoppedFeatures& features) {
  double sum_j = 0.0;
  for (const auto& of : features.vertices()) sum_j += 0.5 * of.mass_kg * of.velocity_m_s.squaredNorm();
  return sum_j;
}

Vec3d momentum_n_s(const StoppedFeatures& features) {
  Vec3d sum = Vec3d::Zero();
  for (const auto& of : features.vertices()) sum += of.mass_kg * of.velocity_m_s;
  return sum;
}

// Two groups: the first two meet at a vertex, the third is by itself.
const std::vector<FeatureCorners> three_stops{
    {{0, 1, 1, 1}, {7, 0, 1, 2}}, {{0, 0, 1, 1}, {7, 8, 3, 4}}, {{0, 1, 1, 1}, {20, 30, 31, 32}}};

TEST(StoppedFeatures, AreListedOnce) {
  const StoppedFeatures features(three_stops);
  ASSERT_EQ(features.vertices().size(), 11U);
  for (std::size_t i = 1; i < 11; ++i) {
    const auto& before = features.vertices()[i - 1];
    const auto& of = features.vertices()[i];
    EXPECT_LT(std::pair(before.body, before.vertex), std::pair(of.body, of.vertex));
  }
}

TEST(StoppedFeatures, KeepTheirMomentumAndGainNoEnergy) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int round = 0; round < 100; ++round) {
    StoppedFeatures features(three_stops);
    for (auto& of : features.vertices()) {
      of.mass_kg = 0.01 + share(random);
      of.share = share(random);
      of.velocity_m_s = any_velocity(random);
    }
    const Vec3d before_n_s = momentum_n_s(features);
    const double before_j = kinetic_j(features);
    features.stop();
    EXPECT_LT((momentum_n_s(features) - before_n_s).norm(), 1e-12);
    EXPECT_LT(kinetic_j(features), before_j);
  }
}

TEST(StoppedFeatures, GoAsOneWhereTheyDidNotMoveAtAll) {
  std::mt19937 random(5);
  StoppedFeatures features(three_stops);
  for (auto& of : features.vertices()) {
    of.mass_kg = 0.2;
    of.share = 0.0;
    of.velocity_m_s = any_velocity(random);
  }
  features.stop();
  const auto velocity = [&](std::uint32_t body, std::uint32_t vertex) {
    for (const auto& of : features.vertices()) {
      if (of.body == body && of.vertex == vertex) return of.velocity_m_s;
    }
    ADD_FAILURE() << body << ", " << vertex;
    return Vec3d(Vec3d::Zero());
  };
  EXPECT_LT((velocity(1, 0) - velocity(1, 4)).norm(), 1e-15);
  EXPECT_LT((velocity(0, 20) - velocity(1, 32)).norm(), 1e-15);
  EXPECT_GT((velocity(0, 20) - velocity(0, 7)).norm(), 0.1);
}

TEST(StoppedFeatures, TakeTheVelocityOfWhatDoesNotGiveWay) {
  StoppedFeatures features({&three_stops.back(), 1});
  for (auto& of : features.vertices()) {
    of.is_held = of.body == 1;
    of.mass_kg = of.is_held ? 0.0 : 0.3;
    of.share = 0.25;
    of.velocity_m_s = of.is_held ? Vec3d(0.0, 1.0, 0.0) : Vec3d(4.0, -3.0, 0.0);
  }
  features.stop();
  EXPECT_EQ(features.vertices().front().velocity_m_s, Vec3d(1.0, 0.0, 0.0));
  EXPECT_EQ(features.vertices().back().velocity_m_s, Vec3d(0.0, 1.0, 0.0));
}

}  // namespace
}  // namespace pneuma::physics
