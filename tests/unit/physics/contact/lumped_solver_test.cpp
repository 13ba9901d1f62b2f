// Shows that the solver for lumped masses finds what solve_rows does with LumpedResponse, sweep by sweep, with friction
// and without, from nothing and from warm impulses, whatever it solved before. That free bodies keep their momentum,
// and that what it ends with keeps the laws of contact.
#include "physics/contact/lumped_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
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

/// With rows of the first so many rigid bodies.
void load(LumpedSolver& solver, std::span<ContactRow> rows, std::span<const SurfaceBody> bodies,
          std::size_t rigid_count, bool wall_is_still = true) {
  std::vector<std::uint32_t> rigid(rigid_count);
  std::iota(rigid.begin(), rigid.end(), 0U);
  SlotTable table;
  table.begin(bodies);
  std::vector<ContactRow*> of_solver;
  for (ContactRow& row : rows) of_solver.push_back(&row);
  const std::vector<std::uint8_t> is_still(1, wall_is_still ? 1 : 0);
  solver.load(of_solver, bodies, {rigid, rigid_count, is_still}, table);
  EXPECT_TRUE(std::ranges::all_of(table.slot_of, [](std::uint32_t slot) { return slot == 0; })) << "for the next one";
}

/// The solver on one world's rows: from their impulses and its velocities, to what both become.
class LumpedRun {
 public:
  LumpedRun(LumpedSolver& solver, ParticleWorld& world, bool with_friction) : solver_(solver), world_(world) {
    if (!with_friction) world.leave_out_friction();
    load(solver, world.rows, world.bodies, 0);
    for (const LumpedSolver::Slot& slot : solver.slots()) {
      const Vec3d& velocity = world.velocities_m_s[slot.body][slot.vertex];
      values_.insert(values_.end(), {velocity.x(), velocity.y(), velocity.z(), 0.0});
    }
    due_.skins.resize(world.rows.size());
    std::iota(due_.skins.begin(), due_.skins.end(), 0U);
    for (std::size_t r = 0; r < world.rows.size(); ++r) solver.impulses()[r].least_m_s = world.rows[r].least_m_s;
  }

  SolveOutcome solve(const SolveLimits& limits) {
    solver_.push(values_);
    const SolveOutcome outcome = solver_.solve(due_, limits, values_);
    for (std::size_t r = 0; r < world_.rows.size(); ++r) world_.rows[r].impulse_n_s = solver_.impulse_n_s(r);
    take_changes();
    return outcome;
  }
  /// In one sweep without friction, from nothing.
  void part() {
    std::vector<double> least;
    for (const ContactRow& row : world_.rows) least.push_back(row.least_m_s);
    solver_.part(due_, least, values_);
    take_changes();
  }
  [[nodiscard]] Vec3d value(std::size_t row) const { return solver_.value(row, values_); }
  [[nodiscard]] double along_normal(std::size_t row) const {
    std::vector<double> along(world_.rows.size());
    solver_.project(values_, along.size(), along);
    return along[row];
  }

 private:
  void take_changes() {
    std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
    for (std::size_t s = 0; s < solver_.slots().size(); ++s) {
      const auto [body, vertex] = solver_.slots()[s];
      EXPECT_TRUE(seen.emplace(body, vertex).second) << "twice";
      EXPECT_EQ(values_[4 * s + 3], 0.0);
      world_.changes_m_s[body][vertex] = Vec3d::Map(values_.data() + 4 * s) - world_.velocities_m_s[body][vertex];
    }
  }

  LumpedSolver& solver_;
  ParticleWorld& world_;
  LumpedSolver::Values values_;
  LumpedSolver::Due due_;
};

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

class SkinRows : public testing::TestWithParam<LumpedCase> {
 protected:
  [[nodiscard]] static ParticleWorld world(unsigned seed) {
    ParticleWorld made(seed, GetParam().with_pins);
    if (GetParam().warm) made.warm(GetParam().with_friction);
    return made;
  }
};

TEST_P(SkinRows, AreSolvedAsByLumpedResponses) {
  LumpedSolver solver;
  double pressed_n_s = 0.0;
  for (unsigned seed = 0; seed < particle_worlds; ++seed) {
    for (const std::uint32_t sweeps : {0U, 1U, 2U, 12U}) {
      ParticleWorld wanted = world(seed);
      if (!GetParam().with_friction) wanted.leave_out_friction();
      ParticleWorld found = world(seed);
      std::vector<Response> responses = wanted.responses();
      solve_rows(wanted.rows, responses, {.sweeps_max = sweeps});
      LumpedRun run(solver, found, GetParam().with_friction);
      EXPECT_EQ(run.solve({.sweeps_max = sweeps}).sweeps, sweeps);
      double largest_n_s = 0.0;
      for (const ContactRow& row : wanted.rows) largest_n_s = std::max(largest_n_s, row.impulse_n_s.norm());
      for (std::size_t i = 0; i < wanted.rows.size(); ++i) {
        ASSERT_LE((found.rows[i].impulse_n_s - wanted.rows[i].impulse_n_s).norm(), 1e-9 * largest_n_s)
            << "world " << seed << ", row " << i << ", sweeps " << sweeps;
        const Vec3d value = velocity_m_s(wanted.rows[i], responses);
        if (is_held(wanted.rows[i], wanted.bodies)) continue;
        ASSERT_LE((run.value(i) - value).norm(), 1e-9 * (1.0 + value.norm()));
        ASSERT_NEAR(run.along_normal(i), value.dot(wanted.rows[i].normal), 1e-9 * (1.0 + value.norm()));
      }
      double largest_m_s = 0.0;
      for (const auto& of : wanted.changes_m_s) {
        for (const Vec3d& change : of) largest_m_s = std::max(largest_m_s, change.norm());
      }
      for (std::size_t b = 0; b < wanted.bodies.size(); ++b) {
        for (std::size_t i = 0; i < wanted.changes_m_s[b].size(); ++i) {
          ASSERT_LE((found.changes_m_s[b][i] - wanted.changes_m_s[b][i]).norm(), 1e-9 * (1.0 + largest_m_s))
              << "world " << seed << ", vertex " << i << " of " << b << ", sweeps " << sweeps;
        }
      }
      pressed_n_s += largest_n_s;
    }
  }
  EXPECT_GT(pressed_n_s, 1.0);
}

TEST_P(SkinRows, PartAsOneSweepWithoutFrictionFromNothing) {
  LumpedSolver solver;
  double moved_m_s = 0.0;
  for (unsigned seed = 0; seed < particle_worlds; ++seed) {
    ParticleWorld wanted(seed, GetParam().with_pins);
    wanted.leave_out_friction();
    ParticleWorld found = world(seed);
    std::vector<Response> responses = wanted.responses();
    solve_rows(wanted.rows, responses, {.sweeps_max = 1});
    LumpedRun(solver, found, GetParam().with_friction).part();
    for (std::size_t b = 0; b < wanted.bodies.size(); ++b) {
      for (std::size_t i = 0; i < wanted.changes_m_s[b].size(); ++i) {
        ASSERT_LE((found.changes_m_s[b][i] - wanted.changes_m_s[b][i]).norm(), 1e-12 * (1.0 + moved_m_s));
        moved_m_s = std::max(moved_m_s, wanted.changes_m_s[b][i].norm());
      }
    }
  }
  EXPECT_GT(moved_m_s, 0.1);
}

TEST_P(SkinRows, KeepTheMomentumOfFreeBodiesAndLeavePinnedVerticesWhereTheyAre) {
  LumpedSolver solver;
  for (unsigned seed = 0; seed < particle_worlds; ++seed) {
    ParticleWorld made = world(seed);
    (void)LumpedRun(solver, made, GetParam().with_friction).solve({.sweeps_max = 12});
    if (GetParam().with_pins) {
      for (std::size_t b = 0; b < made.bodies.size(); ++b) {
        for (std::size_t i = 0; i < 4; ++i) ASSERT_TRUE(made.changes_m_s[b][i].isZero(0.0)) << seed;
      }
    } else {
      double pushed_n_s = 0.0;
      for (const ContactRow& row : made.rows) pushed_n_s += row.impulse_n_s.norm();
      ASSERT_GT(pushed_n_s, 0.0);
      // The changes are differences of velocities of up to 3.5 m/s, on up to 32 kg.
      ASSERT_LE(made.momentum_n_s().norm(), 1e-12 * (1.0 + pushed_n_s)) << seed;
    }
  }
}

TEST_P(SkinRows, KeepTheLawsOfContactOnceTheyAgree) {
  LumpedSolver solver;
  Presses presses;
  for (unsigned seed = 0; seed < particle_worlds; ++seed) {
    ParticleWorld made = world(seed);
    made.rows.erase(made.rows.begin() + 8, made.rows.begin() + 30);  // few enough that all can part
    const SolveLimits limits{.sweeps_max = 100'000, .enough_m_s = 1e-13};
    ASSERT_TRUE(LumpedRun(solver, made, GetParam().with_friction).solve(limits).converged) << seed;
    std::erase_if(made.rows, [&](const ContactRow& row) { return is_held(row, made.bodies); });
    presses = presses + expect_laws(made.rows, made.responses(), 1e-9, 1e-9);
  }
  EXPECT_GT(presses.pressed, 50);
  if (GetParam().with_friction) {
    EXPECT_GT(presses.stuck, 10);
    EXPECT_GT(presses.slid, 10);
  }
}

INSTANTIATE_TEST_SUITE_P(OfAllKinds, SkinRows,
                         testing::Values(LumpedCase{"Frictionless", false, false, false},
                                         LumpedCase{"FrictionlessWarmWithPins", false, true, true},
                                         LumpedCase{"Rubbing", true, false, false},
                                         LumpedCase{"RubbingWithPins", true, false, true},
                                         LumpedCase{"RubbingWarm", true, true, false},
                                         LumpedCase{"RubbingWarmWithPins", true, true, true}),
                         [](const auto& info) { return info.param.name; });

/// Particles at a rigid body and at a wall, each with a row where it is.
struct SolidWorld {
  std::mt19937 random{31};
  std::vector<SurfaceBody> bodies{1};
  std::vector<Vec3d> places_m, velocities_m_s;
  LumpedRigid rigid;
  Vec3d centre_m{0.3, -0.2, 0.1};
  std::vector<ContactRow> rows;
  static constexpr std::uint32_t first_solid = 1;  // the rigid body; the wall comes next

  explicit SolidWorld(unsigned seed) {
    random.seed(seed);
    rigid.velocity = vector(1.0);
    rigid.angular_velocity = vector(2.0);
    rigid.inverse_masses_1_kg = Vec3d::Constant(0.5);
    rigid.inverse_inertia_1_kg_m2 = Vec3d(3.0, 5.0, 7.0).asDiagonal();
    for (std::uint32_t i = 0; i < 12; ++i) {
      bodies[0].inverse_masses_1_kg.push_back(std::uniform_real_distribution<double>(0.5, 20.0)(random));
      velocities_m_s.push_back(vector(2.0));
      places_m.push_back(centre_m + 0.4 * vector(1.0).normalized());
      ContactRow row;
      row.first.add(i, 1.0);
      row.second.body = first_solid + (i < 8 ? 0 : 1);
      row.normal = i < 8 ? Vec3d((places_m[i] - centre_m).normalized()) : Vec3d(Vec3d::UnitY());
      row.friction = i % 3 == 0 ? 0.0 : 0.4;
      rows.push_back(row);
    }
  }
  Vec3d vector(double largest) {
    std::uniform_real_distribution<double> draw(-largest, largest);
    const double x = draw(random);
    const double y = draw(random);
    return {x, y, draw(random)};
  }
  [[nodiscard]] double mass_kg(std::size_t i) const { return 1.0 / bodies[0].inverse_masses_1_kg[i]; }
};

TEST(LumpedRows, OfSolidsKeepTheLawsAndTheMomentaOfWhatIsFree) {
  int pressed = 0;
  int slid = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    SolidWorld world(seed);
    LumpedSolver solver;
    const bool wall_is_still = seed % 2 == 0;
    const Vec3d of_wall_m_s = wall_is_still ? Vec3d(Vec3d::Zero()) : Vec3d(0.5, 0.3, -0.2);
    load(solver, world.rows, world.bodies, 1, wall_is_still);
    solver.rigid()[0] = world.rigid;
    LumpedSolver::Values values(4 * solver.slots().size(), 0.0);
    for (std::size_t s = 0; s < solver.slots().size(); ++s) {
      if (solver.slots()[s].body == 0)
        Vec3d::Map(values.data() + 4 * s) = world.velocities_m_s[solver.slots()[s].vertex];
    }
    for (std::uint32_t r = 8; r < world.rows.size() && !wall_is_still; ++r) {
      Vec3d::Map(values.data() + 4 * solver.point_slot(r)) = of_wall_m_s;
    }
    LumpedSolver::Due due;
    for (std::uint32_t r = 0; r < world.rows.size(); ++r) {
      (r < 8 ? due.rigid : due.fixed).push_back(r);
      solver.turn(r, world.rows[r].normal, r < 8 ? Vec3d(world.places_m[r] - world.centre_m) : Vec3d(Vec3d::Zero()));
      solver.impulses()[r].least_m_s = 0.0;
    }
    const auto momenta = [&] {
      std::pair<Vec3d, Vec3d> sums(solver.rigid()[0].velocity / 0.5, Vec3d::Zero());
      sums.second = world.centre_m.cross(sums.first) +
                    world.rigid.inverse_inertia_1_kg_m2.inverse() * solver.rigid()[0].angular_velocity;
      for (std::uint32_t r = 0; r < 8; ++r) {
        const Vec3d momentum = world.mass_kg(r) * Vec3d::Map(values.data() + 4 * solver.skin_slot(r));
        sums.first += momentum;
        sums.second += world.places_m[r].cross(momentum);
      }
      return sums;
    };
    const auto before = momenta();
    ASSERT_TRUE(solver.solve(due, {.sweeps_max = 100'000, .enough_m_s = 1e-12}, values).converged) << seed;
    const auto after = momenta();
    EXPECT_LT((after.first - before.first).norm(), 1e-11) << seed;
    EXPECT_LT((after.second - before.second).norm(), 1e-11) << seed;
    for (std::uint32_t r = 0; r < world.rows.size(); ++r) {
      const Vec3d of_solid = r < 8 ? solver.rigid_velocity_m_s(r) : of_wall_m_s;
      const Vec3d relative = Vec3d::Map(values.data() + 4 * solver.skin_slot(r)) - of_solid;
      const double opening = relative.dot(world.rows[r].normal);
      const LumpedImpulse& impulse = solver.impulses()[r];
      EXPECT_GE(opening, -1e-9);
      EXPECT_GE(impulse.pressed_n_s, 0.0);
      const Vec3d rubbed = Vec3d::Map(impulse.rubbed_n_s);
      EXPECT_NEAR(rubbed.dot(world.rows[r].normal), 0.0, 1e-9);
      EXPECT_LE(rubbed.norm(), world.rows[r].friction * impulse.pressed_n_s + 1e-9);
      if (impulse.pressed_n_s < 1e-9) continue;
      ++pressed;
      EXPECT_NEAR(opening, 0.0, 1e-9);
      const Vec3d slip = relative - opening * world.rows[r].normal;
      if (slip.norm() < 1e-6 || world.rows[r].friction == 0.0) continue;
      ++slid;
      EXPECT_LT((slip.normalized() + rubbed.normalized()).norm(), 1e-3);
    }
  }
  EXPECT_GT(pressed, 100);
  EXPECT_GT(slid, 30);
}

// Each by its mass; who is locked along an axis is not shifted along it.
TEST(LumpedRows, ShiftARigidBodyApartFromTheSkin) {
  SolidWorld world(3);
  world.rigid.inverse_masses_1_kg.y() = 0.0;
  world.rows.resize(1);
  LumpedSolver solver;
  load(solver, world.rows, world.bodies, 1);
  solver.rigid()[0] = world.rigid;
  solver.turn(0, world.rows[0].normal, Vec3d::Zero());
  LumpedSolver::Values moves(4 * solver.slots().size(), 0.0);
  LumpedSolver::Due due;
  due.rigid.push_back(0);
  solver.part(due, std::vector<double>{0.01}, moves);
  const Vec3d moved = Vec3d::Map(moves.data());
  const Vec3d shift = solver.rigid()[0].shift_m;
  EXPECT_NEAR((moved - shift).dot(world.rows[0].normal), 0.01, 1e-15);
  EXPECT_EQ(shift.y(), 0.0);
  const Vec3d of_rigid = shift / 0.5;
  const Vec3d of_skin = world.mass_kg(0) * moved;
  EXPECT_NEAR(of_rigid.x() + of_skin.x(), 0.0, 1e-15);
  EXPECT_NEAR(of_rigid.z() + of_skin.z(), 0.0, 1e-15);
}

}  // namespace
}  // namespace pneuma::physics
