// What the passes of a coupled step (coupled_step.h) work on.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/contact_bounds.h"
#include "physics/contact/contact_world.h"
#include "physics/contact/factored_response.h"
#include "physics/contact/row.h"
#include "physics/contact/solid_rows.h"
#include "physics/contact/surface_body.h"
#include "physics/state/whole_motion.h"

namespace pneuma::physics {

/// The world after free motion, and what contact knows of it.
template <class Real>
struct CoupledWorld : ContactWorld<Real> {
  std::span<const BodyBounds> bounds;
  std::span<std::uint8_t> soft_touched;  // set of those that got an impulse
  std::span<std::uint8_t> rigid_touched;
  std::span<const ContactRow> rigid_rows;       // among rigid bodies and colliders (rigid_solver.h)
  std::span<const std::uint32_t> rigid_groups;  // one a rigid body, if there are rows
  std::span<std::uint8_t> rigid_solved;         // set of those whose rows were taken
};

/// A soft body's step under way.
struct CoupledBody {
  bool in_contact = false;
  bool has_moved = false;    // freely, in this pass
  bool left_out = false;     // of contact: it could not be solved for
  bool is_cut = false;       // its moves, in some pass
  bool is_free = false;      // nothing holds it but contact and joints
  std::vector<Vec3d> start;  // m, in the world
  std::vector<Vec3d> x0;     // m, from the body's origin
  std::vector<Vec3d> u0, u;  // m/s
  std::vector<Vec3d> step;   // m/s
  double stress_n_m = 0.0;   // of its rotations, in the last pass
  BodyMetric metric;

  [[nodiscard]] const std::vector<double>& masses_kg() const { return metric.matrix().diagonal; }
};

/// The passes under way: where the bodies are, and the rows between them.
struct CoupledPasses {
  std::vector<CoupledBody> bodies;
  std::vector<SolidPlace> solids;                                 // rigid bodies, then colliders
  std::vector<Vec3d> rigid_velocities_m_s, rigid_turnings_rad_s;  // of the pass before
  std::vector<SurfaceBody>* surfaces = nullptr;                   // of the bodies, then of colliders that are meshes
  SolidRowFinder solid_rows;
  SolidCutter solid_cutter;
  std::vector<ContactRow> rows;
  std::vector<Vec3d> joints_left_m;  // of each joint's error, at the substep's end

  [[nodiscard]] const SurfaceBody& surface(std::size_t index) const { return (*surfaces)[index]; }
};

[[nodiscard]] inline Vec3d weighted_sum(std::span<const double> masses_kg, std::span<const Vec3d> values) {
  Vec3d sum = Vec3d::Zero();
  for (std::size_t i = 0; i < values.size(); ++i) sum += masses_kg[i] * values[i];
  return sum;
}

[[nodiscard]] inline double total(std::span<const double> values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum;
}

[[nodiscard]] inline WholeMotion whole_of(const CoupledBody& body, std::span<const Vec3d> places,
                                          std::span<const Vec3d> velocities) {
  return whole_motion(
      places.size(), [&](std::size_t i) { return body.masses_kg()[i]; }, [&](std::size_t i) { return places[i]; },
      [&](std::size_t i) { return velocities[i]; });
}

}  // namespace pneuma::physics
