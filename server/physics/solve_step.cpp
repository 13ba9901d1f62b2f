#include "physics/solve_step.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "physics/forces/force_terms.h"
#include "physics/forces/measures.h"
#include "physics/implicit/implicit_euler.h"
#include "physics/implicit/tr_bdf2.h"
#include "physics/state/whole_motion.h"

namespace pneuma::physics {
namespace {

// A stage in which edges turn far is solved until it is settled, where that matters: Newton's first step takes turns as
// straight ways, and stretches what it turns. Of TR-BDF2 with a driven body always, since its trapezoidal half
// magnifies what the last step left unsolved: a hanging cloth of stretched springs made 24 J of 1 J. Of others where a
// step has gained energy: a soft box of 2e5 N/m that turned in the air held up to 1,800 J where it had 30.
constexpr std::uint32_t turned_iterations = 16;

// Of the kinetic energy: what a step may gain by its method's own error. Implicit Euler's may gain more before it is
// solved again, as it loses as much in the next one.
constexpr double tr_bdf2_gain_share_max = 1e-4;
constexpr double euler_gain_share_max = 1e-2;
// Of the energy: less is rounding.
constexpr double rounding_share = 1e-10;

template <class Real>
double kinetic_j(const SoftState<Real>& body) {
  double sum = 0.0;
  for (std::size_t i = 0; i < body.v.size(); ++i) {
    sum += 0.5 * body.mass_kg(i) * body.v[i].template cast<double>().squaredNorm();
  }
  return sum;
}

template <class Real>
double energy_j(const SoftState<Real>& body, bool moved, const Surroundings& surroundings, std::vector<Vec3d>& places) {
  places.resize(body.x.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    places[i] = body.x[i].template cast<double>();
    if (moved) places[i] += body.dr[i].template cast<double>();
  }
  return kinetic_j(body) + potential_j<Real>(body, {.x = places}, surroundings);
}

// With its particles where they are, or where the substep takes them.
template <class Real>
WholeMotion whole_of(const SoftState<Real>& body, bool moved) {
  return whole_motion(
      body.x.size(), [&](std::size_t i) { return body.mass_kg(i); },
      [&](std::size_t i) {
        const Vec3d place = body.x[i].template cast<double>();
        return moved ? Vec3d(place + body.dr[i].template cast<double>()) : place;
      },
      [&](std::size_t i) { return Vec3d(body.v[i].template cast<double>()); });
}

// Turns a body that nothing holds as a whole, by its velocities alone. Each method's equations lose some of its angular
// momentum: of a ball that turns at 2 rad/s, implicit Euler lost 5 % a second at 60 Hz.
template <class Real>
void keep_spin(SoftState<Real>& body, const Vec3d& spin_kg_m2_s) {
  const WholeMotion after = whole_of(body, true);
  const Vec3d turn_rad_s = after.inverse_inertia_1_kg_m2 * (spin_kg_m2_s - after.spin_kg_m2_s);
  for (std::size_t i = 0; i < body.v.size(); ++i) {
    const Vec3d place = body.x[i].template cast<double>() + body.dr[i].template cast<double>();
    body.v[i] += turn_rad_s.cross(place - after.centre).template cast<Real>();
  }
}

// Whether a step that the method has made has more energy than it began with. Nothing is told of a body that wind or a
// grab works on.
template <class Real>
class EnergyWatch {
 public:
  EnergyWatch(const SoftState<Real>& body, const Surroundings& surroundings, SolverScratch<Real>& scratch)
      : surroundings_(surroundings),
        scratch_(scratch),
        is_on_(!ForceTerms::any([&]<class Term>() { return Term::drives(body, surroundings); })) {
    if (!is_on_) return;
    scratch_.start_m_s = body.v;
    kinetic_j_ = kinetic_j(body);
    start_j_ = energy_j(body, false, surroundings_, scratch_.places);
  }

  // By more than that share of its kinetic energy.
  [[nodiscard]] bool has_gained(const SoftState<Real>& body, double share_max) const {
    if (!is_on_ || body.solve_failed) return false;
    const double gained_j = energy_j(body, true, surroundings_, scratch_.places) - start_j_;
    return gained_j > share_max * std::max(kinetic_j_, kinetic_j(body)) + rounding_share * std::abs(start_j_);
  }
  void take_back(SoftState<Real>& body) const { body.v = scratch_.start_m_s; }

 private:
  const Surroundings& surroundings_;
  SolverScratch<Real>& scratch_;
  bool is_on_;
  double kinetic_j_ = 0.0;
  double start_j_ = 0.0;
};

template <class Real>
void solve_by_method(SoftState<Real>& body, ImplicitTables<Real>& tables, const SolveSettings& settings,
                     const SubstepContext& context, SolverScratch<Real>& scratch) {
  if (context.integrator == Integrator::xpbd) return xpbd(body, context, scratch.xpbd);
  if (!scratch.implicit) scratch.implicit.emplace();
  ImplicitSolver<Real>& solver = *scratch.implicit;
  StageAccuracy closely = settings.accuracy;
  closely.turned_iterations = turned_iterations;
  const bool driven = is_driven(body, context.surroundings);
  const EnergyWatch<Real> watch(body, context.surroundings, scratch);
  if (context.integrator == Integrator::implicit_euler) {
    const FirstGuess guess = driven ? FirstGuess::straight : settings.guess;
    body.solve_failed = !implicit_euler(body, tables, settings.accuracy, context, guess, solver);
    if (!watch.has_gained(body, euler_gain_share_max)) return;
    watch.take_back(body);
    body.solve_failed = !implicit_euler(body, tables, closely, context, guess, solver);
    return;
  }
  assert(context.integrator == Integrator::tr_bdf2);
  body.solve_failed = !tr_bdf2(body, tables, driven ? closely : settings.accuracy, context, solver);
  if (!watch.has_gained(body, tr_bdf2_gain_share_max)) return;
  if (!driven) {
    watch.take_back(body);
    body.solve_failed = !tr_bdf2(body, tables, closely, context, solver);
    if (!watch.has_gained(body, tr_bdf2_gain_share_max)) return;
  }
  if (settings.guess == FirstGuess::straight) return;  // nothing of contact to magnify
  watch.take_back(body);
  body.solve_failed = !euler_again(body, tables, closely, context, solver);
}

}  // namespace

template <class Real>
void solve_step(SoftState<Real>& body, ImplicitTables<Real>& tables, const SolveSettings& settings,
                const SubstepContext& context, SolverScratch<Real>& scratch) {
  body.dr.resize(body.x.size());
  const bool is_free = !is_driven(body, context.surroundings);
  const Vec3d spin_kg_m2_s = is_free ? whole_of(body, false).spin_kg_m2_s : Vec3d(Vec3d::Zero());
  solve_by_method(body, tables, settings, context, scratch);
  if (!is_free || body.solve_failed) return;
  keep_spin(body, spin_kg_m2_s);
  if (!settings.falls_by_parabola || context.integrator != Integrator::implicit_euler) return;
  const Vec3d back_m = -0.5 * context.dt_s * context.dt_s * context.surroundings.gravity;
  for (Vec3<Real>& move : body.dr) move += back_m.cast<Real>();
}

template void solve_step<float>(SoftState<float>&, ImplicitTables<float>&, const SolveSettings&, const SubstepContext&,
                                SolverScratch<float>&);
template void solve_step<double>(SoftState<double>&, ImplicitTables<double>&, const SolveSettings&,
                                 const SubstepContext&, SolverScratch<double>&);

}  // namespace pneuma::physics
