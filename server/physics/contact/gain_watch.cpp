#include "physics/contact/gain_watch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/contact/surface_shell.h"
#include "physics/contact/taken_energy.h"
#include "physics/forces/force_terms.h"
#include "physics/forces/gas.h"
#include "physics/forces/measures.h"
#include "physics/machine/profile.h"
#include "physics/rigid/rigid_motion.h"

namespace pneuma::physics {
namespace {

// A substep may gain this share of its kinetic energy, by its method's own error. It may also gain what lifts its
// bodies by a share of the distance that they keep. Without that, a heap at rest would have all its substeps stepped
// again.
constexpr double watched_share_max = 1e-2;
constexpr double watched_lift_share = 0.5;
// Rigid bodies, which may be a thousand times as heavy as what carries them, are lifted by this share of that.
constexpr double rigid_lift_share = 0.04;
// Rounded places change the energy by so many roundings of it.
constexpr double roundings = 4.0;

struct MovingEnergy {
  double kinetic_j = 0.0;
  double potential_j = 0.0;
  double lift_j = 0.0;  // by the distance that soft bodies keep
};

template <class Real>
void add_energy(const SoftState<Real>& body, const Surroundings& surroundings, std::vector<Vec3d>& places,
                MovingEnergy& sum) {
  places.resize(body.x.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    places[i] = body.x[i].template cast<double>();
    sum.kinetic_j += 0.5 * body.mass_kg(i) * body.v[i].template cast<double>().squaredNorm();
  }
  sum.potential_j += potential_j<Real>(body, {.x = places, .origin_m = body.origin_m}, surroundings);
  sum.lift_j += shell_m(body) * body.body.mass_kg * surroundings.gravity.norm();
}

void add_energy(const RigidState& body, const Surroundings& surroundings, MovingEnergy& sum) {
  sum.kinetic_j += 0.5 * body.body.mass_kg * body.velocity.squaredNorm() +
                   0.5 * body.angular_velocity.dot(inertia_kg_m2(body) * body.angular_velocity);
  sum.potential_j -= body.body.mass_kg * surroundings.gravity.dot(body.position);
}

template <class Real>
MovingEnergy energy_of(const SubstepContext& context, const Moving<Real>& moving) {
  MovingEnergy sum;
  std::vector<Vec3d> places;
  for (const SoftState<Real>& body : moving.soft) {
    if (body.is_awake()) add_energy(body, context.surroundings, places, sum);
  }
  double kept_m = 0.0;
  for (const SoftState<Real>& body : moving.soft) kept_m = std::max(kept_m, shell_m(body));
  for (const RigidState& body : moving.rigid) {
    if (!body.is_awake()) continue;
    add_energy(body, context.surroundings, sum);
    sum.lift_j += rigid_lift_share * kept_m * body.body.mass_kg * context.surroundings.gravity.norm();
  }
  return sum;
}

template <class Real>
bool is_worked_on(const SubstepContext& context, const Moving<Real>& moving, std::span<const JointState> joints) {
  const auto is_pushed = [&](const SoftState<Real>& body) {
    const bool is_pumped = body.gas && flows(*body.body.gas);
    const auto drives = [&]<class Term>() { return Term::drives(body, context.surroundings); };
    return body.is_awake() && (is_pumped || ForceTerms::any(drives));
  };
  const auto moves = [](const ColliderState& state) { return is_moving(state.collider); };
  const auto works = [&](const JointState& state) {
    return state.joint.compliance_m_n > 0.0 || is_apart<Real>(state, moving.soft, moving.rigid, moving.colliders);
  };
  return std::ranges::any_of(moving.soft, is_pushed) || std::ranges::any_of(moving.colliders, moves) ||
         std::ranges::any_of(joints, works);
}

// Bodies that are carried out of solids, against their weight.
template <class Real>
double lifted_j(const SubstepContext& context, const Moving<Real>& moving) {
  double sum_j = 0.0;
  for (std::size_t i = 0; i < moving.carried_m_s.size(); ++i) {
    const bool is_soft = i < moving.soft.size();
    const double mass_kg = is_soft ? moving.soft[i].body.mass_kg : moving.rigid[i - moving.soft.size()].body.mass_kg;
    sum_j += mass_kg * std::max(0.0, -context.surroundings.gravity.dot(context.dt_s * moving.carried_m_s[i]));
  }
  return sum_j;
}

}  // namespace

template <class Real>
void GainWatch<Real>::begin(const SubstepContext& context, const Moving<Real>& moving,
                            std::span<const JointState> joints, std::span<const WarmImpulse> warm) {
  start_.forget();
  const StageTimer timer(context.profile, Stage::integrate);
  if (is_worked_on(context, moving, joints)) return;
  start_.keep(moving, context.substeps_left);
  warm_.assign(warm.begin(), warm.end());
  const MovingEnergy before = energy_of(context, moving);
  kinetic_j_ = before.kinetic_j;
  energy_j_ = before.kinetic_j + before.potential_j;
}

template <class Real>
bool GainWatch<Real>::take_back(const SubstepContext& context, const Moving<Real>& moving,
                                std::vector<WarmImpulse>& warm) {
  if (!start_.can_restore(moving)) return false;
  const StageTimer timer(context.profile, Stage::integrate);
  const MovingEnergy after = energy_of(context, moving);
  const double gained_j = after.kinetic_j + after.potential_j - energy_j_;
  const double rounded_j = roundings * static_cast<double>(std::numeric_limits<Real>::epsilon()) *
                           (kinetic_j_ + std::abs(after.potential_j));
  const double allowed_j =
      watched_share_max * std::max(kinetic_j_, after.kinetic_j) + watched_lift_share * after.lift_j + rounded_j;
  if (!(gained_j > allowed_j + lifted_j(context, moving))) return false;
  start_.restore(moving);
  warm.assign(warm_.begin(), warm_.end());
  return true;
}

template class GainWatch<float>;
template class GainWatch<double>;

}  // namespace pneuma::physics
