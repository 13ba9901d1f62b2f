// Shows that solved rows keep the laws of contact, on bodies of every kind: none approaches past its gap, none pulls,
// none pushes but at its gap, and friction stays in Coulomb's cone and opposes what slips. That bodies get opposite
// impulses, whatever the rows begin with.
#include "physics/contact/solver.h"

#include <algorithm>
#include <array>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "unit/physics/contact/contact_laws.h"
#include "unit/physics/contact/factored_rig.h"

namespace pneuma::physics {
namespace {

constexpr SolveLimits until_agreed{.sweeps_max = 100000, .enough_m_s = 1e-12};

double draw_between(std::mt19937& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

Vec3d draw_vector(std::mt19937& random, double largest) {
  const double x = draw_between(random, -largest, largest);
  const double y = draw_between(random, -largest, largest);
  return {x, y, draw_between(random, -largest, largest)};
}

std::uint32_t draw_below(std::mt19937& random, std::uint32_t count) {
  return static_cast<std::uint32_t>(random() % count);
}

Support draw_support(std::uint32_t body, std::uint32_t vertices, std::mt19937& random) {
  const std::uint32_t first = draw_below(random, vertices);
  const std::array<std::uint32_t, 3> three{first, (first + 1) % vertices, (first + 2) % vertices};
  const double a = draw_between(random, 0.1, 0.5);
  const double b = draw_between(random, 0.1, 0.4);
  return support_at(body, three, std::array{a, b, 1.0 - a - b});
}

/// Random but for the supports: some press, some part, some slip.
ContactRow draw_row(const Support& first, const Support& second, std::mt19937& random) {
  ContactRow row;
  row.first = first;
  row.second = second;
  row.normal = draw_vector(random, 1.0).normalized();
  row.friction = draw_between(random, 0.0, 1.0);
  row.free_m_s = draw_vector(random, 2.0) - row.normal;
  row.least_m_s = draw_between(random, -0.2, 0.2);
  return row;
}

void expect_all_kinds(const Presses& presses) {
  EXPECT_GT(presses.pressed, 10);
  EXPECT_GT(presses.stuck, 5);
  EXPECT_GT(presses.slid, 5);
}

TEST(Solver, KeepsTheLawsAndTheMomentumOfBodiesOfParticles) {
  Presses presses;
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::mt19937 random(seed);
    constexpr std::uint32_t vertices = 12;
    std::vector<double> inverse_masses(vertices);
    for (double& inverse_mass : inverse_masses) inverse_mass = draw_between(random, 0.5, 5.0);
    std::array<std::vector<Vec3d>, 2> changes;
    std::vector<Response> responses;
    for (auto& of : changes) {
      of.assign(vertices, Vec3d::Zero());
      responses.emplace_back(LumpedResponse(inverse_masses, of));
    }
    std::vector<ContactRow> rows;
    for (std::uint32_t i = 0; i < 8; ++i) {
      rows.push_back(draw_row(draw_support(i % 2, vertices, random), draw_support(1, vertices, random), random));
    }
    EXPECT_TRUE(solve_rows(rows, responses, until_agreed).converged);
    presses = presses + expect_laws(rows, responses, 1e-9, 1e-9);
    Vec3d momentum = Vec3d::Zero();
    for (const auto& of : changes) {
      for (std::uint32_t i = 0; i < vertices; ++i) momentum += of[i] / inverse_masses[i];
    }
    EXPECT_LT(momentum.norm(), 1e-12);
  }
  expect_all_kinds(presses);
}

TEST(Solver, KeepsTheLawsAndBothMomentaOfRigidBodies) {
  Presses presses;
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(100 + seed);
    constexpr std::uint32_t bodies = 5;
    std::vector<Vec3d> centres_m;
    std::vector<double> masses_kg;
    std::vector<Eigen::Matrix3d> inertias;
    std::vector<Response> responses;
    for (std::uint32_t i = 0; i < bodies; ++i) {
      centres_m.push_back(draw_vector(random, 2.0));
      masses_kg.push_back(draw_between(random, 0.2, 3.0));
      const Eigen::Matrix3d some = Eigen::Matrix3d::Identity() + 0.3 * cross_matrix(draw_vector(random, 1.0));
      inertias.emplace_back(0.4 * masses_kg.back() * some * some.transpose());
      responses.emplace_back(RigidResponse(1.0 / masses_kg.back(), inertias.back().inverse()));
    }
    std::vector<ContactRow> rows;
    for (std::uint32_t i = 0; i < bodies; ++i) {
      const Vec3d where_m = draw_vector(random, 2.0);
      Support first{.body = i, .arm = where_m - centres_m[i]};
      Support second{.body = (i + 1) % bodies, .arm = where_m - centres_m[(i + 1) % bodies]};
      rows.push_back(draw_row(first, second, random));
    }
    EXPECT_TRUE(solve_rows(rows, responses, until_agreed).converged);
    presses = presses + expect_laws(rows, responses, 1e-9, 1e-9);
    Vec3d momentum = Vec3d::Zero();
    Vec3d angular = Vec3d::Zero();
    for (std::uint32_t i = 0; i < bodies; ++i) {
      const auto& body = std::get<RigidResponse>(responses[i]);
      momentum += masses_kg[i] * body.velocity_change_m_s();
      angular +=
          masses_kg[i] * centres_m[i].cross(body.velocity_change_m_s()) + inertias[i] * body.turning_change_rad_s();
    }
    EXPECT_LT(momentum.norm(), 1e-11);
    EXPECT_LT(angular.norm(), 1e-11);
  }
  expect_all_kinds(presses);
}

/// Rows between a ball that is free, one that is held, a rigid body and the ground.
struct MixedBodies {
  explicit MixedBodies(unsigned seed) {
    std::mt19937 random(seed);
    responses.emplace_back(FactoredResponse(free_ball.metric()));
    responses.emplace_back(FactoredResponse(held_ball.metric()));
    responses.emplace_back(RigidResponse(0.5, 4.0 * Eigen::Matrix3d::Identity()));
    responses.emplace_back(FixedResponse{});
    constexpr std::array<std::array<std::uint32_t, 2>, 8> meets{
        {{0, 1}, {0, 2}, {0, 3}, {0, 0}, {1, 2}, {1, 3}, {2, 3}, {0, 1}}};
    for (const auto& [first, second] : meets) {
      rows.push_back(draw_row(draw_support_of(first, random), draw_support_of(second, random), random));
      for (Support* at : {&rows.back().first, &rows.back().second}) {
        if (auto* ball = std::get_if<FactoredResponse>(&responses[at->body])) ball->add(*at);
      }
    }
    for (const std::size_t i : {0U, 1U}) std::get<FactoredResponse>(responses[i]).finish();
  }
  static Support draw_support_of(std::uint32_t body, std::mt19937& random) {
    if (body < 2) return draw_support(body, 42, random);
    return {.body = body, .arm = draw_vector(random, 0.5)};
  }

  FactoredBall free_ball{{.stiffness_n_m = 1e3, .gas_stiffness = 2.0}};
  FactoredBall held_ball{{.stiffness_n_m = 1e4, .pins = {3, 17}}};
  std::vector<Response> responses;
  std::vector<ContactRow> rows;
};

TEST(Solver, KeepsTheLawsOfFactoredBodiesRigidOnesAndTheGround) {
  Presses presses;
  for (unsigned seed = 0; seed < 10; ++seed) {
    MixedBodies world(200 + seed);
    EXPECT_TRUE(solve_rows(world.rows, world.responses, until_agreed).converged);
    presses = presses + expect_laws(world.rows, world.responses, 1e-9, 1e-9);
    Vec3d on_ball_n_s = Vec3d::Zero();
    for (const ContactRow& row : world.rows) {
      if (row.first.body == 0) on_ball_n_s += row.impulse_n_s;
      if (row.second.body == 0) on_ball_n_s -= row.impulse_n_s;
    }
    EXPECT_LT((std::get<FactoredResponse>(world.responses[0]).impulse_n_s() - on_ball_n_s).norm(), 1e-11);
  }
  expect_all_kinds(presses);
}

TEST(Solver, FindsTheSameFromWarmImpulses) {
  MixedBodies cold(300);
  MixedBodies warm(300);
  solve_rows(cold.rows, cold.responses, until_agreed);
  for (std::size_t i = 0; i < warm.rows.size(); ++i) warm.rows[i].impulse_n_s = 0.9 * cold.rows[i].impulse_n_s;
  EXPECT_TRUE(solve_rows(warm.rows, warm.responses, until_agreed).converged);
  for (std::size_t i = 0; i < warm.rows.size(); ++i) {
    EXPECT_LT((warm.rows[i].impulse_n_s - cold.rows[i].impulse_n_s).norm(), 1e-9) << i;
  }
}

// As where a state overflows: the caller finds the body out.
TEST(Solver, EndsWhereRowsHaveNoNumbers) {
  std::vector<Response> responses{RigidResponse(1.0, Eigen::Matrix3d::Identity()), FixedResponse{}};
  std::vector<ContactRow> rows(3);
  for (ContactRow& row : rows) {
    row.first.body = 0;
    row.second.body = 1;
    row.impulse_n_s = Vec3d::Constant(std::numeric_limits<double>::infinity());
    row.free_m_s = Vec3d::Constant(-1.0);
  }
  EXPECT_LE(solve_rows(rows, responses, {.sweeps_max = 4, .enough_m_s = 1e-6}).sweeps, 4U);
}

}  // namespace
}  // namespace pneuma::physics
