#include "physics/simulation.h"

#include <algorithm>
#include <cmath>

#include "base/limits.h"
#include "physics/gas.h"
#include "physics/soft_setup.h"

namespace pneuma::physics {

namespace {

constexpr const char* not_finite = "its motion was no longer finite";
constexpr const char* torn_apart = "it was torn apart: a particle moved past its own body in one step";
constexpr const char* too_fast = "it went past the limit of speed";
constexpr const char* too_far = "it went past the limit of place";

// Whether every particle's move and velocity are finite and within limits. A comparison with NaN is false, so a NaN
// fails it.
template <class Real>
bool is_well(const SoftState<Real>& body) {
  const auto speed_max = static_cast<Real>(base::speed_max_m_s);
  const auto coordinate_max = static_cast<Real>(base::coordinate_max_m);
  const Real stray_max = static_cast<Real>(base::runaway_body_lengths) * body.length_m;
  Vec3<Real> mean_move = Vec3<Real>::Zero();
  for (const Vec3<Real>& move : body.dr) mean_move += move;
  mean_move /= static_cast<Real>(body.dr.size());
  bool well = true;
  for (std::size_t i = 0; i < body.x.size(); ++i) {
    const Vec3<Real> end = body.x[i] + body.dr[i];
    well &= body.v[i].squaredNorm() <= speed_max * speed_max;
    well &= (end.array().abs() <= coordinate_max).all();
    well &= (body.dr[i] - mean_move).squaredNorm() <= stray_max * stray_max;
  }
  return well;
}

// What made the body no longer well; the first that holds, in the order from what says most.
template <class Real>
const char* runaway_reason(const SoftState<Real>& body) {
  const auto speed_max = static_cast<Real>(base::speed_max_m_s);
  const Real stray_max = static_cast<Real>(base::runaway_body_lengths) * body.length_m;
  const auto any = [&body](const auto& holds) {
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      if (holds(i)) return true;
    }
    return false;
  };
  if (any([&](std::size_t i) { return !body.v[i].allFinite() || !body.dr[i].allFinite(); })) return not_finite;
  Vec3<Real> mean_move = Vec3<Real>::Zero();
  for (const Vec3<Real>& move : body.dr) mean_move += move;
  mean_move /= static_cast<Real>(body.dr.size());
  if (any([&](std::size_t i) { return !((body.dr[i] - mean_move).squaredNorm() <= stray_max * stray_max); })) {
    return torn_apart;
  }
  if (any([&](std::size_t i) { return !(body.v[i].squaredNorm() <= speed_max * speed_max); })) return too_fast;
  return too_far;
}

const char* runaway_reason(const RigidState& body) {
  if (!body.velocity.allFinite() || !body.angular_velocity.allFinite() || !body.position.allFinite()) return not_finite;
  const bool fast = body.velocity.norm() > base::speed_max_m_s || body.angular_velocity.norm() > base::speed_max_m_s;
  return fast ? too_fast : too_far;
}

}  // namespace

RigidState make_rigid_state(const RigidBody& body) {
  RigidState state;
  state.body = body;
  state.position = body.position;
  state.orientation = body.orientation;
  state.velocity = body.velocity;
  state.angular_velocity = body.angular_velocity;
  state.inverse_mass_1_kg = 1.0 / body.mass_kg;
  Vec3d inertia;
  if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) {
    inertia.setConstant(0.4 * body.mass_kg * sphere->radius_m * sphere->radius_m);
  } else {
    const Vec3d squares = std::get<BoxShape>(body.shape).half_extents_m.cwiseAbs2();
    inertia = body.mass_kg / 3.0 * (Vec3d::Constant(squares.sum()) - squares);
  }
  state.inverse_inertia_1_kg_m2 = inertia.cwiseInverse();
  return state;
}

ColliderState make_collider_state(const Collider& collider) {
  return {collider, collider.position, collider.orientation};
}

Simulation::Simulation(Scene initial, SubstepChoice substeps) : scene(std::move(initial)), choice(std::move(substeps)) {
  if (scene.stepping.precision == Precision::double_precision) soft.emplace<SoftBodies<double>>();
  visit([&]<class Real>(SoftBodies<Real>& bodies) {
    for (const SoftBody& body : scene.soft_bodies) bodies.states.push_back(make_soft_state<Real>(body));
    bodies.scratch.resize(bodies.states.size());
  });
  for (const RigidBody& body : scene.rigid_bodies) rigid.push_back(make_rigid_state(body));
  for (const Collider& collider : scene.colliders) colliders.push_back(make_collider_state(collider));
}

bool Simulation::substep(Workers& workers) {
  visit([&](auto& bodies) { substep_bodies(bodies, workers); });
  if (++substep_index < choice.substeps) return false;
  substep_index = 0;
  ++tick;
  return true;
}

// The paper's algorithm (section 2.4): steps 1 to 4 a body, then 5 with all of them, then 6.
template <class Real>
void Simulation::substep_bodies(SoftBodies<Real>& bodies, Workers& workers) {
  const double dt_s = period_s() / choice.substeps;
  const Surroundings surroundings{scene.gravity, scene.atmosphere};
  if (profiling) bodies.profiles.resize(bodies.states.size());

  workers.for_each(bodies.states.size(), [&](std::size_t i) {
    SoftState<Real>& body = bodies.states[i];
    if (body.frozen) return;
    if (body.gas) flow_gas(*body.gas, *body.body.gas, body.pressure_pa, scene.atmosphere.pressure_pa, dt_s);
    integrate(body, scene.stepping.integrator, surroundings, dt_s, bodies.scratch[i],
              profiling ? &bodies.profiles[i] : nullptr);
  });

  Profile* shared_profile = profiling ? &profile : nullptr;
  freeze_runaways(bodies);  // before they meet others
  rigid_before.clear();
  for (const RigidState& body : rigid) rigid_before.push_back({body.position, body.orientation});
  accelerate_rigid_bodies(rigid, scene.gravity, dt_s);
  bodies.contacts.resolve(bodies.states, rigid, colliders, scene.gravity, dt_s, workers, shared_profile);

  freeze_runaways(bodies);

  const StageTimer timer(shared_profile, Stage::move);
  for (SoftState<Real>& body : bodies.states) {
    if (body.frozen) continue;
    for (std::size_t i = 0; i < body.x.size(); ++i) body.x[i] += body.dr[i];
  }
  move_solids(rigid, colliders, dt_s);
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    RigidState& body = rigid[i];
    if (body.frozen || is_active(body)) continue;
    frozen.push_back({body.body.name, runaway_reason(body)});
    body.position = rigid_before[i].position;
    body.orientation = rigid_before[i].orientation;
    body.velocity.setZero();
    body.angular_velocity.setZero();
    body.frozen = true;
  }
}

// A body that has run away keeps the place where it was last well.
template <class Real>
void Simulation::freeze_runaways(SoftBodies<Real>& bodies) {
  for (SoftState<Real>& body : bodies.states) {
    if (body.frozen || is_well(body)) continue;
    frozen.push_back({body.body.name, runaway_reason(body)});
    std::ranges::fill(body.v, Vec3<Real>::Zero());
    std::ranges::fill(body.dr, Vec3<Real>::Zero());
    body.frozen = true;
  }
}

}  // namespace pneuma::physics
