// One body outside of any world: what its forces and its implicit steps need.
#pragma once

#include <memory>
#include <vector>

#include "physics/implicit_solver.h"
#include "physics/isa.h"

namespace pneuma::physics {

template <class Real>
class BodyTables {
 public:
  explicit BodyTables(const SoftState<Real>& body) {
    const LaneKernels<Real>& kernels = lane_kernels<Real>(isa_in_use());
    const Mesh& mesh = *body.body.mesh;
    mesh_->rings = make_rings(mesh);
    mesh_->lengths_m = ring_lengths_m<Real>(mesh, mesh_->rings, kernels.slot_of_place);
    tables = {{mesh_.get(), &kernels}, matrices_.get(), {}};
  }

  ImplicitTables<Real> tables;

 private:
  std::unique_ptr<LaneMesh<Real>> mesh_ = std::make_unique<LaneMesh<Real>>();
  std::unique_ptr<ImplicitMatrices> matrices_ = std::make_unique<ImplicitMatrices>();
};

/// The body's forces at `x` and `v`; its volume and pressure are those there afterwards.
inline std::vector<Vec3d> forces_at(SoftState<double>& body, const Surroundings& surroundings,
                                    const std::vector<Vec3d>& x, const std::vector<Vec3d>& v) {
  const BodyTables<double> tables(body);
  BodyForces<double> forces;
  forces.evaluate(body, tables.tables.lanes, surroundings, x, v, nullptr);
  return {forces.force_n().begin(), forces.force_n().end()};
}
inline std::vector<Vec3d> forces_on(SoftState<double>& body, const Surroundings& surroundings) {
  return forces_at(body, surroundings, body.x, body.v);
}

}  // namespace pneuma::physics
