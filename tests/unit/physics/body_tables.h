// One body outside of any world: what its forces and its implicit steps need.
#pragma once

#include <memory>
#include <vector>

#include "physics/choice/step_plan.h"
#include "physics/implicit/implicit_solver.h"

namespace pneuma::physics {

template <class Real>
class BodyTables {
 public:
  explicit BodyTables(const SoftState<Real>& body) : plan_(make_step_plan<Real>({&body, 1}, false, Abreast::none, {})) {
    tables = {{&plan_.mesh_of(0), plan_.kernels}, matrices_.get(), {}};
  }

  ImplicitTables<Real> tables;

 private:
  StepPlan<Real> plan_;
  std::unique_ptr<ImplicitMatrices> matrices_ = std::make_unique<ImplicitMatrices>();
};

/// The body's forces at `x` and `v`; its volume and pressure are those there afterwards.
inline std::vector<Vec3d> forces_at(SoftState<double>& body, const Surroundings& surroundings,
                                    const std::vector<Vec3d>& x, const std::vector<Vec3d>& v) {
  const BodyTables<double> tables(body);
  BodyForces<double> forces;
  forces.evaluate(body, tables.tables.lanes, {.surroundings = surroundings}, x, v);
  return {forces.force_n().begin(), forces.force_n().end()};
}
inline std::vector<Vec3d> forces_on(SoftState<double>& body, const Surroundings& surroundings) {
  return forces_at(body, surroundings, body.x, body.v);
}

}  // namespace pneuma::physics
