#include "physics/solve_step.h"

#include <cassert>

#include "physics/implicit/implicit_euler.h"
#include "physics/implicit/tr_bdf2.h"

namespace pneuma::physics {
namespace {

// TR-BDF2's trapezoidal half takes the force where the last step ended, and magnifies what that step left unsolved: a
// hanging cloth of stretched springs made 24 J of 1 J. So a stage in which edges turn far is solved until it is
// settled.
constexpr std::uint32_t tr_bdf2_turned_iterations = 16;

}  // namespace

template <class Real>
void solve_step(SoftState<Real>& body, ImplicitTables<Real>& tables, const Method& method,
                const Surroundings& surroundings, std::span<const SolidMove> colliders,
                std::span<const Vec3<Real>> start_m_s, double dt_s, SolverScratch<Real>& scratch, ContactNotes* notes,
                Profile* profile) {
  body.dr.resize(body.x.size());
  if (method.integrator == Integrator::xpbd) return xpbd(body, surroundings, dt_s, scratch.xpbd, profile);
  if (!scratch.implicit) scratch.implicit.emplace();
  scratch.implicit->forget_turns();
  const bool is_driven = !body.pinned.empty() || !body.grabs.empty() || has_wind(body.body, surroundings.atmosphere);
  if (method.integrator == Integrator::implicit_euler) {
    body.solve_failed = !implicit_euler(body, tables, method.accuracy, surroundings, dt_s, *scratch.implicit, profile);
  } else {
    assert(method.integrator == Integrator::tr_bdf2);
    StageAccuracy accuracy = method.accuracy;
    if (is_driven) accuracy.turned_iterations = tr_bdf2_turned_iterations;
    body.solve_failed = !tr_bdf2(body, tables, accuracy, surroundings, dt_s, *scratch.implicit, profile);
  }
  if (body.solve_failed || start_m_s.empty()) return;
  if (scratch.implicit->has_turned() && !is_driven) scratch.contact.limit_step(body, start_m_s, surroundings, dt_s);
  if (colliders.empty()) return;
  scratch.contact.meet_colliders(body, start_m_s, tables, method.accuracy, surroundings, colliders, dt_s,
                                 *scratch.implicit, notes, profile);
}

template void solve_step<float>(SoftState<float>&, ImplicitTables<float>&, const Method&, const Surroundings&,
                                std::span<const SolidMove>, std::span<const Vec3<float>>, double, SolverScratch<float>&,
                                ContactNotes*, Profile*);
template void solve_step<double>(SoftState<double>&, ImplicitTables<double>&, const Method&, const Surroundings&,
                                 std::span<const SolidMove>, std::span<const Vec3<double>>, double,
                                 SolverScratch<double>&, ContactNotes*, Profile*);

}  // namespace pneuma::physics
