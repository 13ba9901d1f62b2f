// Shows that springs of one mesh may differ in stiffness, up to a million times: in a strip of triangles that hangs,
// each spring is longer by its own F / k, by every method; momentum is kept; an edit of the factors takes effect and
// goes on from where the body is.
#include <Eigen/LU>

#include "numerics/worlds.h"

namespace pneuma::physics {
namespace {

constexpr double gravity_m_s2 = 9.81;

/// A strip of triangles in the x-y plane that hangs from its first two vertices; each other one hangs from the two
/// before it, by two springs. So statics alone gives every tension.
SoftBody strip(std::size_t vertex_count, double factor_max) {
  std::vector<Vec3d> positions_m;
  std::vector<Face> faces;
  SoftBody body;
  for (std::size_t i = 0; i < vertex_count; ++i) {
    positions_m.emplace_back(i % 2 == 0 ? -0.1 : 0.1, -0.1 * static_cast<double>(i), 0.0);
    const double share = static_cast<double>(i * 5 % vertex_count) / static_cast<double>(vertex_count - 1);
    body.springs.vertex_stiffness_scale.push_back(std::pow(factor_max, share));
  }
  for (std::uint32_t i = 2; i < vertex_count; ++i) {
    faces.push_back(i % 2 == 0 ? Face{i - 2, i, i - 1} : Face{i - 2, i - 1, i});
  }
  body.name = "strip";
  body.mesh = *make_mesh(positions_m, faces);
  body.mass_kg = 0.01 * static_cast<double>(vertex_count);
  body.springs.stiffness_n_m = 100.0;
  body.springs.damping_n_s_m = 0.5;
  body.pins = {0, 1};
  return body;
}

/// The pulls of the springs of each vertex to the two before it: of those to i - 2 and i - 1, from the lowest up.
std::vector<Eigen::Vector2d> tensions_n(const SoftBody& body, const std::vector<Vec3d>& x) {
  const auto towards = [&x](std::size_t from, std::size_t to) { return Vec3d((x[to] - x[from]).normalized()); };
  const double weight_n = body.mass_kg / static_cast<double>(x.size()) * gravity_m_s2;
  std::vector<Eigen::Vector2d> tensions(x.size(), Eigen::Vector2d::Zero());
  for (std::size_t i = x.size() - 1; i >= 2; --i) {
    Vec3d load(0.0, -weight_n, 0.0);
    for (const std::size_t below : {i + 1, i + 2}) {
      if (below < x.size()) load += tensions[below][below == i + 1 ? 1 : 0] * towards(i, below);
    }
    Eigen::Matrix2d directions;
    directions << towards(i, i - 2).head<2>(), towards(i, i - 1).head<2>();
    tensions[i] = directions.lu().solve(Eigen::Vector2d(-load.head<2>()));
  }
  return tensions;
}

/// Within `tolerance` of the body's weight.
void expect_extensions_of_statics(const World& world, double tolerance) {
  const SoftBody& body = world.soft_body(0);
  const double weight_n = body.mass_kg * gravity_m_s2;
  const std::vector<Vec3d> x = positions_of(world);
  const std::vector<Eigen::Vector2d> tensions = tensions_n(body, x);
  for (std::size_t e = 0; e < body.mesh->edges.size(); ++e) {
    const auto [a, b] = body.mesh->edges[e];
    if (b < 2) continue;  // between the pins
    const std::vector<double>& factors = body.springs.vertex_stiffness_scale;
    const double stiffness_n_m = body.springs.stiffness_n_m * 0.5 * (factors[a] + factors[b]);
    const double extension_m = (x[b] - x[a]).norm() - body.mesh->edge_lengths_m[e];
    const double tension_n = tensions[b][b - a == 2 ? 0 : 1];
    EXPECT_NEAR(stiffness_n_m * extension_m, tension_n, tolerance * weight_n) << "edge " << a << " to " << b;
  }
}

Scene hung(SoftBody body, Integrator integrator, std::uint32_t substeps) {
  Scene scene;
  scene.gravity = {0.0, -gravity_m_s2, 0.0};
  scene.stepping.integrator = integrator;
  scene.stepping.substeps = substeps;
  // Of what the implicit methods leave out in a step.
  if (integrator == Integrator::implicit_euler || integrator == Integrator::tr_bdf2) scene.stepping.error_target = 1e-5;
  scene.stepping.sleep = false;
  scene.soft_bodies = {std::move(body)};
  return scene;
}

class UnlikeSprings : public testing::TestWithParam<Integrator> {
 protected:
  [[nodiscard]] static bool is_implicit() {
    return GetParam() == Integrator::implicit_euler || GetParam() == Integrator::tr_bdf2;
  }
};

TEST_P(UnlikeSprings, OfAHangingStripStretchByTheirLoadOverTheirOwnStiffness) {
  const double factor_max = is_implicit() ? 1e6 : 30.0;
  World world = make_world(hung(strip(9, factor_max), GetParam(), is_implicit() ? 4 : 0));
  run_ticks(world, 60 * 60);
  // What an implicit step may leave out, and what one pass of XPBD does not reach.
  const double tolerance = is_implicit() ? 1e-3 : GetParam() == Integrator::xpbd ? 1e-2 : 1e-6;
  expect_extensions_of_statics(world, tolerance);
}

TEST_P(UnlikeSprings, KeepTheMomentumOfAFreeBall) {
  BreathingBall ball{.subdivisions = 2, .damping_n_s_m = 0.5};
  Scene scene = ball.scene(1.1, GetParam(), 60.0, is_implicit() ? 1 : 0);
  SoftBody& body = scene.soft_bodies[0];
  body.velocity = {1.0, -2.0, 0.5};
  for (const Vec3d& x : body.mesh->positions_m) body.springs.vertex_stiffness_scale.push_back(x.y() > 0.0 ? 50.0 : 1.0);
  World world = make_world(std::move(scene));
  const Vec3d before = world.measure(0).momentum;
  run_ticks(world, 60);
  EXPECT_LT((world.measure(0).momentum - before).norm(), 1e-11 * before.norm());
}

INSTANTIATE_TEST_SUITE_P(Methods, UnlikeSprings, testing::ValuesIn(every_integrator), test_name_of);

TEST(UnlikeSpringsEdited, TakeEffectAndGoOnFromWhereTheBodyIs) {
  World world = make_world(hung(strip(9, 30.0), Integrator::implicit_euler, 4));
  run_ticks(world, 60 * 60);
  const std::vector<Vec3d> before = positions_of(world);
  Scene scene = world.scene();
  std::ranges::reverse(scene.soft_bodies[0].springs.vertex_stiffness_scale);
  ASSERT_TRUE(world.apply(scene).ok());
  EXPECT_TRUE(positions_of(world) == before);
  run_ticks(world, 60 * 60);
  EXPECT_GT(distance_m(positions_of(world), before), 1e-4);
  expect_extensions_of_statics(world, 1e-3);
}

}  // namespace
}  // namespace pneuma::physics
