// Shows that the sampled volumes are the exact one to within their resolution, whatever the skin: by bodies of known
// volume, by how fast the error falls on bodies turned at random, and by what must change nothing at all: where a body
// is, how its faces are listed, and whether the lines of the grid meet faces, edges or vertices.
#include "physics/forces/sampled_volume.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "physics/forces/volume.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

struct Skin {
  std::vector<Vec3d> x;
  std::vector<Face> faces;

  [[nodiscard]] double exact_m3() const { return signed_volume_m3(x, faces); }
};

Skin skin_of(const base::Result<std::shared_ptr<const Mesh>>& mesh) {
  return {(*mesh)->positions_m, (*mesh)->faces};
}

// Of revolution about y: a ring's hole and outside are seen along every line.
Skin torus_skin(std::uint32_t around, std::uint32_t across) {
  Skin skin;
  for (std::uint32_t i = 0; i < around; ++i) {
    for (std::uint32_t j = 0; j < across; ++j) {
      const double a = 2.0 * std::numbers::pi * i / around;
      const double b = 2.0 * std::numbers::pi * j / across;
      const double radius_m = 1.0 + 0.4 * std::cos(b);
      skin.x.emplace_back(radius_m * std::cos(a), 0.4 * std::sin(b), radius_m * std::sin(a));
      const auto at = [&](std::uint32_t u, std::uint32_t v) { return u % around * across + v % across; };
      skin.faces.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      skin.faces.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return skin;
}

// Closed, and through itself many times.
Skin scattered(unsigned seed) {
  Skin skin = skin_of(make_icosphere(2, 1.0));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> anywhere(-1.0, 1.0);
  for (Vec3d& p : skin.x) p += 0.3 * Vec3d{anywhere(random), anywhere(random), anywhere(random)};
  return skin;
}

Skin moved(Skin skin, const Eigen::Matrix3d& map, const Vec3d& shift) {
  for (Vec3d& p : skin.x) p = map * p + shift;
  return skin;
}

Eigen::Matrix3d random_rotation(std::mt19937& random) {
  std::uniform_real_distribution<double> anywhere(-1.0, 1.0);
  const Quatd turn{anywhere(random), anywhere(random), anywhere(random), anywhere(random)};
  return turn.normalized().toRotationMatrix();
}

struct SamplingMethod {
  std::string name;
  double (*volume_m3)(std::span<const Vec3d>, std::span<const Face>, std::uint32_t);
  double (*volume_m3_single)(std::span<const Vec3<float>>, std::span<const Face>, std::uint32_t);
  std::vector<std::uint32_t> ladder;  // of resolutions
  double order;                       // at least, in the resolution
  double error_max;                   // at the end of the ladder, relative

  [[nodiscard]] double operator()(const Skin& skin, std::uint32_t resolution) const {
    return volume_m3(skin.x, skin.faces, resolution);
  }
};

class SampledVolume : public testing::TestWithParam<SamplingMethod> {
 protected:
  const SamplingMethod& volume_m3 = GetParam();
};

INSTANTIATE_TEST_SUITE_P(Methods, SampledVolume,
                         testing::Values(SamplingMethod{"subdivided",
                                                        &subdivided_volume_m3<double>,
                                                        &subdivided_volume_m3<float>,
                                                        {8, 16, 32, 64},
                                                        1.0,
                                                        0.001},
                                         SamplingMethod{"monte_carlo",
                                                        &monte_carlo_volume_m3<double>,
                                                        &monte_carlo_volume_m3<float>,
                                                        {256, 1024, 4096, 65536},
                                                        0.5,
                                                        0.003}),
                         [](const auto& param) { return param.param.name; });

TEST_P(SampledVolume, OfABoxAlongTheAxesIsExact) {
  const Skin box = skin_of(make_box({0.3, 1.7, 0.9}, 3));
  for (const std::uint32_t resolution : {1U, 2U, 3U, 7U, 100U}) {
    EXPECT_NEAR(volume_m3(box, resolution), box.exact_m3(), 1e-14) << resolution;
  }
}

TEST_P(SampledVolume, ConvergesOnBodiesTurnedAndShearedAtRandom) {
  std::mt19937 random(3);
  Eigen::Matrix3d shear = Eigen::Matrix3d::Identity();
  shear(0, 1) = 0.7;
  shear(2, 0) = -0.4;
  for (const Skin& skin :
       {skin_of(make_icosphere(3, 1.0)), skin_of(make_box({1.0, 0.4, 0.7}, 1)), torus_skin(40, 20)}) {
    std::vector<Skin> skins;
    for (int i = 0; i < 40; ++i) skins.push_back(moved(skin, random_rotation(random) * shear, Vec3d(1, 2, 3)));
    std::vector<double> errors;  // relative, root mean square
    for (const std::uint32_t resolution : volume_m3.ladder) {
      double squares = 0.0;
      for (const Skin& one : skins) squares += std::pow(volume_m3(one, resolution) / one.exact_m3() - 1.0, 2);
      errors.push_back(std::sqrt(squares / static_cast<double>(skins.size())));
    }
    EXPECT_LT(errors.back(), volume_m3.error_max);
    const double finer = static_cast<double>(volume_m3.ladder.back()) / volume_m3.ladder.front();
    EXPECT_GT(std::log(errors.front() / errors.back()) / std::log(finer), volume_m3.order);
  }
}

TEST_P(SampledVolume, CountsASkinThroughItselfAsTheExactOneDoes) {
  double squares = 0.0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Skin skin = scattered(seed);
    squares += std::pow(volume_m3(skin, volume_m3.ladder.back()) / skin.exact_m3() - 1.0, 2);
  }
  EXPECT_LT(std::sqrt(squares / 20.0), volume_m3.error_max);
}

// A box whose vertices and edges lie on every line of the finest grid, mapped so that its faces there slope.
TEST_P(SampledVolume, HoldsWhereLinesMeetEdgesAndVertices) {
  Eigen::Matrix3d shear = Eigen::Matrix3d::Identity();
  shear(2, 0) = 0.5;
  shear(2, 1) = 0.25;
  const Skin box = moved(skin_of(make_box({1, 1, 1}, 16)), shear, Vec3d::Zero());
  for (const std::uint32_t resolution : {1U, 2U, 4U, 8U}) {
    EXPECT_NEAR(subdivided_volume_m3<double>(box.x, box.faces, resolution), 8.0, 1e-13) << resolution;
  }
  EXPECT_NEAR(volume_m3(box, volume_m3.ladder.back()), 8.0, 8.0 * volume_m3.error_max);
}

TEST_P(SampledVolume, OfASkinTurnedInsideOutIsTheSameBelowZero) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    Skin skin = scattered(seed);
    const double outside_out_m3 = volume_m3(skin, 100);
    for (Face& face : skin.faces) std::swap(face[1], face[2]);
    EXPECT_EQ(volume_m3(skin, 100), -outside_out_m3);
  }
}

TEST_P(SampledVolume, DependsNeitherOnThePlaceNorOnTheOrderOfFaces) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    Skin skin = scattered(seed);
    for (Vec3d& p : skin.x) p = (p * 0x1p20).array().round() * 0x1p-20;  // no digit is lost on the way
    const double volume = volume_m3(skin, 100);
    const Skin away = moved(skin, Eigen::Matrix3d::Identity(), Vec3d(1024.0, -512.0, 4096.0));
    EXPECT_EQ(volume_m3(away, 100), volume);
    for (Face& face : skin.faces) std::rotate(face.begin(), face.begin() + 1, face.end());
    std::mt19937 random(seed);
    std::shuffle(skin.faces.begin(), skin.faces.end(), random);
    EXPECT_NEAR(volume_m3(skin, 100), volume, 1e-13);
  }
}

TEST_P(SampledVolume, OfASkinInTooManyLayersIsNotFound) {
  Skin layers = skin_of(make_box({1, 1, 1}, 1));
  const std::vector<Face> one = layers.faces;
  const std::uint32_t finest = volume_m3.ladder.back();
  EXPECT_NEAR(volume_m3(layers, finest), 8.0, 1e-12);
  for (int i = 0; i < 20'000; ++i) layers.faces.insert(layers.faces.end(), one.begin(), one.end());
  EXPECT_EQ(volume_m3(layers, finest), 0.0);
}

TEST_P(SampledVolume, InSinglePrecisionAgrees) {
  const Skin skin = torus_skin(40, 20);
  std::vector<Vec3<float>> x;
  for (const Vec3d& p : skin.x) x.push_back(p.cast<float>());
  for (const std::uint32_t resolution : volume_m3.ladder) {
    EXPECT_NEAR(volume_m3.volume_m3_single(x, skin.faces, resolution), volume_m3(skin, resolution), 0.002);
  }
}

TEST_P(SampledVolume, OfNumbersThatAreNoneEndsWithoutHarm) {
  const double infinite = std::numeric_limits<double>::infinity();
  for (const double bad : {infinite, -infinite, std::numeric_limits<double>::quiet_NaN()}) {
    for (const std::size_t vertex : {0U, 7U, 41U}) {
      Skin skin = skin_of(make_icosphere(1, 1.0));
      skin.x[vertex].y() = bad;
      skin.x[vertex].x() = bad;
      [[maybe_unused]] const double volume = volume_m3(skin, 64);  // sanitizers and asserts watch
    }
  }
}

// The samples are the same on every machine and with every compiler. How many are inside an octahedron,
// |x| + |y| + |z| < 1, was counted in fractions from the definition of the samples.
TEST(MonteCarlo, TheSameSamplesAreInsideEverywhere) {
  const Skin octahedron{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}},
                        {{0, 1, 2}, {1, 3, 2}, {3, 4, 2}, {4, 0, 2}, {1, 0, 5}, {3, 1, 5}, {4, 3, 5}, {0, 4, 5}}};
  const auto inside = [&](std::uint32_t samples) {
    return monte_carlo_volume_m3<double>(octahedron.x, octahedron.faces, samples) / 8.0 * samples;
  };
  EXPECT_NEAR(inside(256), 40.0, 1e-9);
  EXPECT_NEAR(inside(4'096), 688.0, 1e-9);
  EXPECT_NEAR(inside(65'536), 10'918.0, 1e-9);
}

class SampledBody : public testing::TestWithParam<Volume> {};

INSTANTIATE_TEST_SUITE_P(Methods, SampledBody,
                         testing::Values(Volume{VolumeMethod::subdivided, 1}, Volume{VolumeMethod::monte_carlo, 1}));

// Two crumbs at opposite corners of their box.
TEST_P(SampledBody, TooSmallForItsSamplesHasItsExactVolume) {
  SoftBody body;
  body.mesh = *make_mesh(
      {{0, 0, 0}, {0.03, 0, 0}, {0, 0.02, 0}, {0, 0, 0.01}, {1, 2, 3}, {0.97, 2, 3}, {1, 1.98, 3}, {1, 2, 2.99}},
      {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {4, 5, 6}, {4, 7, 5}, {5, 7, 6}, {6, 7, 4}});
  body.volume = GetParam();
  EXPECT_NEAR(body_volume_m3<double>(body, body.mesh->positions_m), 2e-6, 1e-15);
}

TEST_P(SampledBody, TurnedInsideOutHasItsExactVolumeBelowZero) {
  SoftBody body;
  body.mesh = *make_icosphere(2, 1.0);
  body.volume = GetParam();
  std::vector<Vec3d> x = body.mesh->positions_m;
  EXPECT_GT(body_volume_m3<double>(body, x), 0.0);
  for (Vec3d& p : x) p.y() = -p.y();
  EXPECT_DOUBLE_EQ(body_volume_m3<double>(body, x), -signed_volume_m3(body.mesh->positions_m, body.mesh->faces));
}

TEST_P(SampledBody, FlatHasNoVolume) {
  SoftBody body;
  body.mesh = *make_icosphere(1, 1.0);
  body.volume = GetParam();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<Vec3d> x = body.mesh->positions_m;
    for (Vec3d& p : x) p[axis] = 0.5;
    EXPECT_EQ(body_volume_m3<double>(body, x), 0.0);
  }
  EXPECT_EQ(body_volume_m3<double>(body, std::vector<Vec3d>(body.mesh->positions_m.size(), Vec3d(1, 2, 3))), 0.0);
}

}  // namespace
}  // namespace pneuma::physics
