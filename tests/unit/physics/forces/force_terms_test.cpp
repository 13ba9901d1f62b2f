// Shows that a force which lacks a part does not compile, and, over the list of forces, that each one's force is minus
// the gradient of its energy, and that its tangent is its force's derivative.
// Each acts alone on a body of its own.
#include "physics/forces/force_terms.h"

#include <cmath>

#include <gtest/gtest.h>

#include "physics/forces/measures.h"
#include "physics/forces/soft_setup.h"
#include "physics/mesh/mesh_builders.h"
#include "unit/physics/body_tables.h"

namespace pneuma::physics {
namespace {

static_assert(ForceTerm<GravityForce>);
// Each hides a part by something that is none.
struct LacksStage : GravityForce {
  static constexpr int stage = 0;
};
struct LacksPresence : GravityForce {
  static constexpr int is_present = 0;
};
struct LacksRings : GravityForce {
  static constexpr int is_in_rings = 0;
};
struct LacksBytes : GravityForce {
  static constexpr int bytes = 0;
};
struct LacksAdding : GravityForce {
  static constexpr int add = 0;
};
struct LacksPotential : GravityForce {
  static constexpr int potential_j = 0;
};
struct LacksMeasure : GravityForce {
  static constexpr int measure = 0;
};
struct LacksTangent : GravityForce {
  static constexpr int linearise = 0;
};
struct LacksVolumeStiffness : GravityForce {
  static constexpr int volume_stiffness_pa_m3 = 0;
};
struct LacksStiffening : GravityForce {
  static constexpr int stiffen = 0;
};
struct LacksSkin : GravityForce {
  static constexpr int add_to_skin = 0;
};
struct LacksRestVolumeStiffness : GravityForce {
  static constexpr int rest_volume_stiffness_pa_m3 = 0;
};
struct LacksDragAtRest : GravityForce {
  static constexpr int drag_at_rest_n_s_m = 0;
};
struct LacksXpbd : GravityForce {
  template <class Real>
  struct Xpbd : XpbdNoConstraints, XpbdNoneBetween, XpbdNoDamping, XpbdNoRoom {};  // no push
};
struct LacksDrives : GravityForce {
  static constexpr int drives = 0;
};
struct LacksKeepsAwake : GravityForce {
  static constexpr int keeps_awake = 0;
};
struct LacksPredictable : GravityForce {
  static constexpr int is_predictable = 0;
};
template <class... Terms>
inline constexpr bool none_is_a_term = (!ForceTerm<Terms> && ...);
static_assert(
    none_is_a_term<LacksStage, LacksPresence, LacksRings, LacksBytes, LacksAdding, LacksPotential, LacksMeasure,
                   LacksTangent, LacksVolumeStiffness, LacksStiffening, LacksSkin, LacksRestVolumeStiffness,
                   LacksDragAtRest, LacksXpbd, LacksDrives, LacksKeepsAwake, LacksPredictable>);

/// A body on which one force acts, in places where its tangent leaves nothing out.
struct Alone {
  SoftState<double> state;
  Surroundings surroundings;
  bool by_places = true;  // the tangent knows how the force changes with places, not with speeds alone
};

SoftState<double> shaken_body(SoftBody body, double by_m) {
  body.name = "body";
  SoftState<double> state = make_soft_state<double>(body);
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const auto phase = static_cast<double>(i);
    state.x[i] = 1.2 * state.x[i] + by_m * Vec3d(std::sin(3.0 * phase), std::cos(5.0 * phase), std::sin(7.0 * phase));
  }
  return state;
}

/// A force that is new in the list needs one here.
template <class Term>
Alone alone();

// No spring is compressed, and none moves, or damping would turn with it.
template <>
Alone alone<SpringForce>() {
  SoftBody body;
  body.mesh = *make_icosphere(1, 1.0);
  body.springs = {.stiffness_n_m = 300.0, .damping_n_s_m = 2.0, .rest_scale = 0.7};
  return {shaken_body(body, 0.03), {}};
}
// Bent by nothing: the tangent has no moment's share.
template <>
Alone alone<BendingForce>() {
  SoftBody body;
  body.mesh = *make_icosphere(1, 1.0);
  body.springs.bend_stiffness_n_m = 2.0;
  return {shaken_body(body, 0.0), {}};
}
template <>
Alone alone<GravityForce>() {
  SoftBody body;
  body.mesh = *make_icosphere(1, 1.0);
  return {shaken_body(body, 0.03), {.gravity = {1.0, -9.81, 0.5}, .atmosphere = {}}};
}
template <>
Alone alone<GasForce>() {
  SoftBody body;
  body.mesh = *make_icosphere(1, 1.0);
  body.gas = Gas{.moles = 0.1, .law = GasLaw::adiabatic};
  return {shaken_body(body, 0.03), {.gravity = Vec3d::Zero(), .atmosphere = {.pressure_pa = 20.0}}};
}
// It turns with the faces, which the tangent leaves out.
template <>
Alone alone<WindForce>() {
  SoftBody body;
  body.mesh = *make_icosphere(1, 1.0);
  body.drag = {.normal = 0.8, .tangential = 0.3};
  const Atmosphere air{.density_kg_m3 = 1.2, .wind = {3.0, 4.0, 1.0}};
  return {shaken_body(body, 0.03), {.gravity = Vec3d::Zero(), .atmosphere = air}, false};
}
template <>
Alone alone<GrabForce>() {
  SoftBody body;
  body.mesh = *make_icosphere(1, 1.0);
  Alone held{shaken_body(body, 0.03), {}};
  held.state.grabs = {{.id = 1, .vertex = 3, .target = {1.0, 2.0, 3.0}, .stiffness_n_m = 10.0, .damping_n_s_m = 2.0},
                      {.id = 2, .vertex = 3, .target = {0.0, 2.0, 0.0}, .stiffness_n_m = 30.0, .damping_n_s_m = 0.0}};
  return held;
}

double length_of(std::span<const Vec3d> points) {
  double sum = 0.0;
  for (const Vec3d& point : points) sum += point.squaredNorm();
  return std::sqrt(sum);
}

std::vector<Vec3d> direction_of(std::size_t count) {
  std::vector<Vec3d> u;
  for (std::size_t i = 0; i < count; ++i) {
    const auto phase = static_cast<double>(i);
    u.emplace_back(std::sin(phase + 1.0), std::cos(4.0 * phase), std::sin(2.0 * phase));
  }
  return u;
}

template <class Term>
class EachForce : public testing::Test {};
template <class List>
struct TypesOf;
template <class... Terms>
struct TypesOf<ForceList<Terms...>> {
  using type = testing::Types<Terms...>;
};
TYPED_TEST_SUITE(EachForce, TypesOf<ForceTerms>::type);

TYPED_TEST(EachForce, ActsAlone) {
  const Alone body = alone<TypeParam>();
  ForceTerms::for_each([&]<class Term>() {
    EXPECT_EQ(Term::is_present(body.state, body.surroundings), (std::same_as<Term, TypeParam>));
  });
}

TYPED_TEST(EachForce, IsMinusTheGradientOfItsEnergy) {
  Alone body = alone<TypeParam>();
  if constexpr (term_parts::NoPotential<TypeParam>) {
    EXPECT_EQ(potential_j(body.state, {.x = body.state.x}, body.surroundings), 0.0) << TypeParam::potential_j.why;
  } else {
    for (Vec3d& x : body.state.x) x += 0.05 * Vec3d(std::sin(9.0 * x.x()), x.z(), x.y());  // where bending pushes too
    const std::vector<Vec3d> force = forces_on(body.state, body.surroundings);
    ASSERT_GT(length_of(force), 0.0);
    std::vector<Vec3d> x = body.state.x;
    const double step_m = 1e-5;
    for (const std::size_t vertex : {std::size_t{0}, std::size_t{17}, std::size_t{41}}) {
      for (int axis = 0; axis < 3; ++axis) {
        const double at = x[vertex][axis];
        x[vertex][axis] = at + step_m;
        const double above_j = TypeParam::potential_j(body.state, {.x = x}, body.surroundings);
        x[vertex][axis] = at - step_m;
        const double below_j = TypeParam::potential_j(body.state, {.x = x}, body.surroundings);
        x[vertex][axis] = at;
        EXPECT_NEAR((below_j - above_j) / (2 * step_m), force[vertex][axis], 1e-6 * length_of(force));
      }
    }
  }
}

/// The matrix' diagonal, the tangents and what goes along the volume's gradient, times u.
std::vector<Vec3d> tangent_times(Alone& body, const ImplicitMatrix& matrix, std::span<const Vec3d> u) {
  const double s = matrix.constants.s;
  SoftState<double>& state = body.state;
  const BodyTables<double> tables(state);
  BodyForces<double> forces;
  forces.evaluate(state, tables.tables.lanes, {.surroundings = body.surroundings}, state.x, state.v);
  Tangents tangents;
  linearise(state, {state.x, state.v, s, body.surroundings, matrix.opposite}, tangents);
  std::vector<Vec3d> product(u.size());
  MotionRows rows;
  MotionRows by_tangents(u.size());
  to_rows(u, matrix.factor.places(), rows);
  add_tangent_products(tangents, matrix, rows, by_tangents);
  from_rows(by_tangents, matrix.factor.places(), product);
  for (std::size_t i = 0; i < u.size(); ++i) product[i] += matrix.diagonal[i] * u[i];
  const std::span<const Vec3d> gradient = forces.volume_gradient_m2();
  if (gradient.empty()) return product;
  const double along = s * s * volume_stiffness_pa_m3(state) * dot(gradient, u);
  for (std::size_t i = 0; i < u.size(); ++i) product[i] += along * gradient[i];
  return product;
}

TYPED_TEST(EachForce, HasTheTangentOfItsForce) {
  constexpr double s = 0.01;
  constexpr double e = 1e-6;
  Alone body = alone<TypeParam>();
  ImplicitMatrices matrices;
  ImplicitMatrixPtr matrix;
  matrices.update(matrix, body.state, body.surroundings, s);
  const std::vector<Vec3d> u = direction_of(body.state.x.size());
  const auto force_at = [&](double share) {
    std::vector<Vec3d> x = body.state.x;
    std::vector<Vec3d> v = body.state.v;
    for (std::size_t i = 0; i < u.size(); ++i) {
      if (body.by_places) x[i] += share * s * u[i];
      v[i] += share * u[i];
    }
    return forces_at(body.state, body.surroundings, x, v);
  };
  const std::vector<Vec3d> ahead = force_at(e);
  const std::vector<Vec3d> behind = force_at(-e);
  std::vector<Vec3d> expected(u.size());
  for (std::size_t i = 0; i < u.size(); ++i) expected[i] = -s * (ahead[i] - behind[i]) / (2.0 * e);
  std::vector<Vec3d> found = tangent_times(body, *matrix, u);
  for (std::size_t i = 0; i < u.size(); ++i) found[i] -= body.state.mass_kg(i) * u[i];
  std::vector<Vec3d> missed = found;
  for (std::size_t i = 0; i < u.size(); ++i) missed[i] -= expected[i];
  EXPECT_LT(length_of(missed), 1e-5 * length_of(expected) + 1e-12);
}

}  // namespace
}  // namespace pneuma::physics
