// The methods that solve for where a substep ends: implicit Euler, TR-BDF2 and XPBD. The explicit ones are in
// lane_step.h.
#pragma once

#include <optional>

#include "physics/contact/implicit_contact.h"
#include "physics/forces/forces.h"
#include "physics/implicit/implicit_solver.h"
#include "physics/xpbd/xpbd.h"

namespace pneuma::physics {

/// Room for one body's solve at a time, of any body; kept between substeps. Holds only what the method needs.
template <class Real>
struct SolverScratch {
  std::optional<ImplicitSolver<Real>> implicit;  // implicit Euler and TR-BDF2 only
  ImplicitContact<Real> contact;
  XpbdScratch<Real> xpbd;

  [[nodiscard]] std::size_t bytes() const {
    return (implicit ? implicit->bytes() : 0) + contact.bytes() + xpbd.bytes();
  }
};

/// How a world's bodies are stepped; the integrator is none of the explicit ones.
struct Method {
  Integrator integrator = Integrator::implicit_euler;
  StageAccuracy accuracy;
};

/// Advances body.v by dt_s and sets body.dr to the move that belongs to it; body.x stays, for contact to cut the move
/// first. `start_m_s`: the velocities before the step, where the body can touch anything. There the implicit methods
/// keep from adding energy (contact_limit.h), and they meet the colliders themselves (implicit_contact.h). Pinned
/// particles keep still. XPBD needs nothing in the tables. Where an implicit solve fails, the body says so in
/// solve_failed. `notes`: null, or where the contacts that it answered are appended.
template <class Real>
void solve_step(SoftState<Real>& body, ImplicitTables<Real>& tables, const Method& method,
                const Surroundings& surroundings, std::span<const SolidMove> colliders,
                std::span<const Vec3<Real>> start_m_s, double dt_s, SolverScratch<Real>& scratch, ContactNotes* notes,
                Profile* profile);

}  // namespace pneuma::physics
