// The methods that solve for where a substep ends: implicit Euler, TR-BDF2 and XPBD. The explicit ones are in
// lane_step.h.
#pragma once

#include <optional>

#include "physics/implicit/implicit_euler.h"
#include "physics/implicit/implicit_solver.h"
#include "physics/xpbd/xpbd.h"

namespace pneuma::physics {

/// Room for one body's solve at a time, of any body; kept between substeps. Holds only what the method needs.
template <class Real>
struct SolverScratch {
  std::optional<ImplicitSolver<Real>> implicit;  // implicit Euler and TR-BDF2 only
  XpbdScratch<Real> xpbd;
  // Of the implicit methods, where a step could gain energy.
  std::vector<Vec3<Real>> start_m_s;
  std::vector<Vec3d> places;

  [[nodiscard]] std::size_t bytes() const {
    return (implicit ? implicit->bytes() : 0) + xpbd.bytes() + start_m_s.capacity() * sizeof(Vec3<Real>) +
           places.capacity() * sizeof(Vec3d);
  }
};

/// How a world's bodies are solved for.
struct SolveSettings {
  StageAccuracy accuracy;
  FirstGuess guess = FirstGuess::straight;
  /// Of implicit Euler: a body that nothing holds falls by a parabola, not by the velocity that its step ends with.
  /// What it touches then must be met within the step.
  bool falls_by_parabola = false;
};

/// By the context's integrator, which is none of the explicit ones: advances body.v by dt_s and sets body.dr to the
/// move that belongs to it; body.x stays, for contact to cut the move first. Pinned particles keep still. XPBD needs
/// nothing in the tables. Where an implicit solve fails, the body says so in solve_failed.
template <class Real>
void solve_step(SoftState<Real>& body, ImplicitTables<Real>& tables, const SolveSettings& settings,
                const SubstepContext& context, SolverScratch<Real>& scratch);

}  // namespace pneuma::physics
