#include "physics/contact/pass_outcome.h"

#include <utility>

namespace pneuma::physics {

PassOutcome PassOutcome::of(const CoupledPasses& passes, const StoppedFeatures& stopped, double gained_j) {
  PassOutcome outcome;
  outcome.gained_j_ = gained_j;
  outcome.bodies_.reserve(passes.bodies.size());
  for (std::size_t i = 0; i < passes.bodies.size(); ++i) {
    const SurfaceBody& surface = passes.surface(i);
    outcome.bodies_.push_back({surface.from, surface.to, passes.bodies[i].u, passes.bodies[i].stress_n_m});
  }
  outcome.solids_ = passes.solids;
  outcome.rigid_velocities_m_s_ = passes.rigid_velocities_m_s;
  outcome.rigid_turnings_rad_s_ = passes.rigid_turnings_rad_s;
  outcome.rows_ = passes.rows;
  outcome.stopped_ = stopped;
  return outcome;
}

void PassOutcome::put_back(CoupledPasses& passes, StoppedFeatures& stopped) && {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    SurfaceBody& surface = (*passes.surfaces)[i];
    surface.from.swap(bodies_[i].places_m);
    surface.to.swap(bodies_[i].ends_m);
    passes.bodies[i].u.swap(bodies_[i].u);
    passes.bodies[i].stress_n_m = bodies_[i].stress_n_m;
  }
  passes.solids.swap(solids_);
  passes.rigid_velocities_m_s.swap(rigid_velocities_m_s_);
  passes.rigid_turnings_rad_s.swap(rigid_turnings_rad_s_);
  passes.rows.swap(rows_);
  stopped = std::move(stopped_);
}

}  // namespace pneuma::physics
