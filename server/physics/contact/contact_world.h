// What contact is given: the world of one substep, between its bodies' free motion and their moves.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "physics/contact/contact_note.h"
#include "physics/contact/joint.h"
#include "physics/implicit/implicit_solver.h"
#include "physics/rigid/contact_surface.h"
#include "physics/state/extents.h"
#include "physics/state/state.h"
#include "physics/state/substep_context.h"

namespace pneuma::physics {

struct SubstepPhysics {
  Vec3d gravity_m_s2 = Vec3d::Zero();
  double dt_s = 0.0;
  double resting_m_s = 0.0;

  [[nodiscard]] static SubstepPhysics of(const Vec3d& gravity_m_s2, double dt_s) {
    return {gravity_m_s2, dt_s, resting_substeps * gravity_m_s2.norm() * dt_s};
  }
};

/// Spans are one a soft body, unless they are of others.
template <class Real>
struct ContactWorld {
  SubstepContext substep;  // with workers
  std::span<SoftState<Real>> soft;
  std::span<RigidState> rigid;
  std::span<const ColliderState> colliders;
  // Where the method is implicit: the bodies' tables, and their velocities before the substep (of sleepers none).
  std::span<ImplicitTables<Real>> tables = {};
  std::span<const std::vector<Vec3<Real>>> start_m_s = {};
  std::optional<StageAccuracy> first_order = {};  // of a method that is not implicit Euler: how to step by that
  // Of implicit methods: what rows held as the step before ended, sorted by key; then, as this one did.
  std::vector<WarmImpulse>* warm = nullptr;
  std::span<JointState> joints = {};            // those that break are marked
  std::span<const Vec3d> carried_m_s = {};      // within their velocities, what takes overlapping bodies apart
  std::span<ContactNotes> notes = {};           // what was answered is appended; or none
  TouchTally* touches = nullptr;                // likewise
  std::span<const Extents<Real>> extents = {};  // of those that are awake, where they are known already

  /// How fast a body is carried. Rigid bodies are numbered after the soft ones, as responses are.
  [[nodiscard]] Vec3d carried(std::size_t body) const {
    return body < carried_m_s.size() ? carried_m_s[body] : Vec3d(Vec3d::Zero());
  }
  [[nodiscard]] bool is_implicit() const { return !start_m_s.empty(); }
  [[nodiscard]] SubstepPhysics physics() const {
    return SubstepPhysics::of(substep.surroundings.gravity, substep.dt_s);
  }
};

}  // namespace pneuma::physics
