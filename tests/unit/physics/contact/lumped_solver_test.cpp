// Shows that the solver for lumped masses finds what solve_rows does with LumpedResponse, sweep by sweep, with friction
// and without, from nothing and from warm impulses, whatever it solved before. That free bodies keep their momentum,
// and that what it ends with keeps the laws of contact.
#include "physics/contact/lumped_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "unit/physics/contact/contact_laws.h"

namespace pneuma::physics {
namespace {

constexpr unsigned particle_worlds = 40;

/// Bodies of particles and rows between them, at random: of faces, edges and vertices, of two bodies or of one.
struct ParticleWorld {
  ParticleWorld(unsigned seed, bool with_pins) : random(seed) {
    bodies.resize(2 + seed % 3);
    for (SurfaceBody& body : bodies) {
      body.inverse_masses_1_kg.resize(6 + random() % 10);
      for (double& inverse_mass : body.inverse_masses_1_kg) inverse_mass = std::pow(10.0, between(-1.5, 1.5));
      // With its first four pinned, rows come up that nothing answers.
      for (std::size_t i = 0; i < 4 && with_pins; ++i) body.inverse_masses_1_kg[i] = 0.0;
      changes_m_s.emplace_back(body.inverse_masses_1_kg.size(), Vec3d::Zero());
      std::vector<Vec3d>& velocities = velocities_m_s.emplace_back();
      for (const double inverse_mass : body.inverse_masses_1_kg) {
        velocities.push_back(inverse_mass > 0.0 ? vector(2.0) : Vec3d::Zero());
      }
    }
    for (int i = 0; i < 30; ++i) rows.push_back(row());
    if (with_pins) rows.push_back(row_of_pins());
  }

  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
  Vec3d vector(double largest) {
    const double x = between(-largest, largest);
    const double y = between(-largest, largest);
    return {x, y, between(-largest, largest)};
  }

  /// From impulses of some solve before.
  void warm(bool with_friction) {
    for (ContactRow& row : rows) {
      if (random() % 3 == 0) continue;
      const double pressed_n_s = between(0.0, 0.5);
      row.impulse_n_s = pressed_n_s * row.normal;
      const Vec3d some = vector(0.3 * row.friction * pressed_n_s);
      if (with_friction) row.impulse_n_s += some - some.dot(row.normal) * row.normal;
    }
  }
  void leave_out_friction() {
    for (ContactRow& row : rows) row.friction = 0.0;
  }
  std::vector<Response> responses() {
    std::vector<Response> all;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      all.emplace_back(LumpedResponse(bodies[i].inverse_masses_1_kg, changes_m_s[i]));
    }
    return all;
  }
  [[nodiscard]] Vec3d momentum_n_s() const {
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      for (std::size_t k = 0; k < changes_m_s[i].size(); ++k) {
        sum += changes_m_s[i][k] / bodies[i].inverse_masses_1_kg[k];
      }
    }
    return sum;
  }

  std::mt19937 random;
  std::vector<SurfaceBody> bodies;
  std::vector<std::vector<Vec3d>> velocities_m_s;  // of each vertex, before
  std::vector<std::vector<Vec3d>> changes_m_s;     // and what the solver makes of it
  std::vector<ContactRow> rows;

 private:
  /// Of no vertex twice.
  ContactRow row() {
    constexpr std::array<std::array<std::uint32_t, 2>, 5> counts{{{1, 3}, {2, 2}, {1, 2}, {1, 1}, {3, 1}}};
    const auto [first, second] = counts[random() % counts.size()];
    const auto a = static_cast<std::uint32_t>(random() % bodies.size());
    const auto b = static_cast<std::uint32_t>(random() % bodies.size());
    ContactRow row = row_of(support(a, first, 0), support(b, second, first));
    row.friction = random() % 4 == 0 ? 0.0 : between(0.0, 1.0);
    return row;
  }
  /// It says that they approach, whatever answers.
  ContactRow row_of_pins() {
    Support first{.body = 0};
    Support second{.body = 1};
    first.add(1, 1.0);
    second.add(2, 0.5);
    second.add(3, 0.5);
    ContactRow row = row_of(first, second);
    row.free_m_s = -row.normal;
    return row;
  }
  ContactRow row_of(const Support& first, const Support& second) {
    ContactRow row;
    row.first = first;
    row.second = second;
    row.normal = vector(1.0).normalized();
    row.friction = 0.5;
    row.free_m_s = velocity_m_s(first) - velocity_m_s(second);
    row.least_m_s = between(-0.2, 0.0);  // so that the rows can agree: with all at rest, they do
    return row;
  }
  [[nodiscard]] Vec3d velocity_m_s(const Support& at) const {
    Vec3d sum = Vec3d::Zero();
    for (std::uint32_t i = 0; i < at.count; ++i) sum += at.weights[i] * velocities_m_s[at.body][at.vertices[i]];
    return sum;
  }
  /// The vertices of the first support are even and those of the second odd.
  Support support(std::uint32_t body, std::uint32_t count, std::uint32_t is_second) {
    const auto half = static_cast<std::uint32_t>(bodies[body].inverse_masses_1_kg.size() / 2);
    const auto start = static_cast<std::uint32_t>(random() % half);
    Support at{.body = body};
    double left = 1.0;
    for (std::uint32_t i = 0; i < count; ++i) {
      const double weight = i + 1 == count ? left : left * between(0.2, 0.7);
      left -= weight;
      at.add(2 * ((start + i) % half) + (is_second == 0 ? 0 : 1), weight);
    }
    return at;
  }
};

/// Takes the solver's changes over into the world's.
void take_changes(const LumpedSolver& solver, ParticleWorld& world) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
  solver.for_changes([&](std::uint32_t body, std::uint32_t vertex, const Vec3d& change_m_s) {
    EXPECT_TRUE(seen.emplace(body, vertex).second) << "twice";
    world.changes_m_s[body][vertex] = change_m_s;
  });
}

/// Nothing answers it, so no law binds it.
bool is_held(const ContactRow& row, const std::vector<SurfaceBody>& bodies) {
  const auto are_pinned = [&](const Support& at) {
    return std::all_of(at.vertices.begin(), at.vertices.begin() + at.count,
                       [&](std::uint32_t vertex) { return bodies[at.body].inverse_masses_1_kg[vertex] == 0.0; });
  };
  return are_pinned(row.first) && are_pinned(row.second);
}

struct LumpedCase {
  std::string name;
  bool with_friction = false;
  bool warm = false;
  bool with_pins = false;
};

class LumpedRows : public testing::TestWithParam<LumpedCase> {
 protected:
  [[nodiscard]] static ParticleWorld world(unsigned seed) {
    ParticleWorld made(seed, GetParam().with_pins);
    if (GetParam().warm) made.warm(GetParam().with_friction);
    return made;
  }
};

TEST_P(LumpedRows, AreSolvedAsByLumpedResponses) {
  LumpedSolver solver;
  double pressed_n_s = 0.0;
  for (unsigned seed = 0; seed < particle_worlds; ++seed) {
    const ParticleWorld loaded = world(seed);
    solver.load(loaded.rows, loaded.bodies);
    for (const std::uint32_t sweeps : {0U, 1U, 2U, 12U}) {
      ParticleWorld wanted = world(seed);
      if (!GetParam().with_friction) wanted.leave_out_friction();
      ParticleWorld found = world(seed);
      std::vector<Response> responses = wanted.responses();
      solve_rows(wanted.rows, responses, {.sweeps_max = sweeps});
      EXPECT_EQ(solver.solve(found.rows, {.sweeps_max = sweeps}, GetParam().with_friction).sweeps, sweeps);
      take_changes(solver, found);
      double largest_n_s = 0.0;
      for (const ContactRow& row : wanted.rows) largest_n_s = std::max(largest_n_s, row.impulse_n_s.norm());
      for (std::size_t i = 0; i < wanted.rows.size(); ++i) {
        ASSERT_LE((found.rows[i].impulse_n_s - wanted.rows[i].impulse_n_s).norm(), 1e-9 * largest_n_s)
            << "world " << seed << ", row " << i << ", sweeps " << sweeps;
      }
      double largest_m_s = 0.0;
      for (const auto& of : wanted.changes_m_s) {
        for (const Vec3d& change : of) largest_m_s = std::max(largest_m_s, change.norm());
      }
      for (std::size_t b = 0; b < wanted.bodies.size(); ++b) {
        for (std::size_t i = 0; i < wanted.changes_m_s[b].size(); ++i) {
          ASSERT_LE((found.changes_m_s[b][i] - wanted.changes_m_s[b][i]).norm(), 1e-9 * largest_m_s)
              << "world " << seed << ", vertex " << i << " of " << b << ", sweeps " << sweeps;
        }
      }
      pressed_n_s += largest_n_s;
    }
  }
  EXPECT_GT(pressed_n_s, 1.0);
}

TEST_P(LumpedRows, KeepTheMomentumOfFreeBodiesAndLeavePinnedVerticesWhereTheyAre) {
  LumpedSolver solver;
  for (unsigned seed = 0; seed < particle_worlds; ++seed) {
    ParticleWorld made = world(seed);
    solver.load(made.rows, made.bodies);
    solver.solve(made.rows, {.sweeps_max = 12}, GetParam().with_friction);
    take_changes(solver, made);
    if (GetParam().with_pins) {
      for (std::size_t b = 0; b < made.bodies.size(); ++b) {
        for (std::size_t i = 0; i < 4; ++i) ASSERT_TRUE(made.changes_m_s[b][i].isZero(0.0)) << seed;
      }
    } else {
      double pushed_n_s = 0.0;
      for (const ContactRow& row : made.rows) pushed_n_s += row.impulse_n_s.norm();
      ASSERT_GT(pushed_n_s, 0.0);
      ASSERT_LE(made.momentum_n_s().norm(), 1e-13 * pushed_n_s) << seed;
    }
  }
}

TEST_P(LumpedRows, KeepTheLawsOfContactOnceTheyAgree) {
  LumpedSolver solver;
  Presses presses;
  for (unsigned seed = 0; seed < particle_worlds; ++seed) {
    ParticleWorld made = world(seed);
    made.rows.erase(made.rows.begin() + 8, made.rows.begin() + 30);  // few enough that all can part
    solver.load(made.rows, made.bodies);
    const SolveLimits limits{.sweeps_max = 100'000, .enough_m_s = 1e-13};
    const bool agreed = solver.solve(made.rows, limits, GetParam().with_friction).converged;
    ASSERT_TRUE(agreed) << seed;
    if (!GetParam().with_friction) made.leave_out_friction();
    std::erase_if(made.rows, [&](const ContactRow& row) { return is_held(row, made.bodies); });
    take_changes(solver, made);
    presses = presses + expect_laws(made.rows, made.responses(), 1e-9, 1e-9);
  }
  EXPECT_GT(presses.pressed, 50);
  if (GetParam().with_friction) {
    EXPECT_GT(presses.stuck, 10);
    EXPECT_GT(presses.slid, 10);
  }
}

INSTANTIATE_TEST_SUITE_P(OfAllKinds, LumpedRows,
                         testing::Values(LumpedCase{"Frictionless", false, false, false},
                                         LumpedCase{"FrictionlessWarmWithPins", false, true, true},
                                         LumpedCase{"Rubbing", true, false, false},
                                         LumpedCase{"RubbingWithPins", true, false, true},
                                         LumpedCase{"RubbingWarm", true, true, false},
                                         LumpedCase{"RubbingWarmWithPins", true, true, true}),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace pneuma::physics
