// Bodies that an implicit step solved for, and all that they touch, solved together: each contact is a row, each body
// one response, and the step and its contacts come out of the same passes.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics/contact/contact_bounds.h"
#include "physics/contact/contact_note.h"
#include "physics/contact/factored_response.h"
#include "physics/contact/groups.h"
#include "physics/contact/joint.h"
#include "physics/contact/solid_rows.h"
#include "physics/contact/surface_contacts.h"
#include "physics/implicit/implicit_solver.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// What a coupled step is given: the world after free motion. The spans of soft bodies are one a body.
template <class Real>
struct CoupledWorld {
  std::span<SoftState<Real>> soft;
  std::span<ImplicitTables<Real>> tables;
  std::span<const std::vector<Vec3<Real>>> start_m_s;  // before the substep; empty of sleepers
  std::span<const BodyBounds> bounds;
  std::span<RigidState> rigid;
  std::span<const ColliderState> colliders;
  Surroundings surroundings;
  double resting_m_s = 0.0;
  double dt_s = 0.0;
  std::optional<StageAccuracy> first_order = {};  // of a method that is not implicit Euler: how to step by that
  std::span<JointState> joints = {};              // those of soft bodies are solved for, and marked where they break
  std::span<ContactNotes> notes;                  // or none
  std::span<std::uint8_t> soft_touched;           // set of those that got an impulse
  std::span<std::uint8_t> rigid_touched;
};

template <class Real>
class CoupledStep {
 public:
  /// Changes v and dr of the soft bodies in contact, and the velocities of the rigid ones.
  void run(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces);

  [[nodiscard]] const RowCounts& counts() const { return counts_; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  /// A soft body's step under way.
  struct Body {
    bool in_contact = false;
    bool is_free = false;      // nothing holds it but contact and joints
    std::vector<Vec3d> start;  // m, in the world
    std::vector<Vec3d> x0;     // m, from the body's origin
    std::vector<Vec3d> u0, u;  // m/s
    std::vector<Vec3d> step;   // m/s
    BodyMetric metric;
  };

  void load(const CoupledWorld<Real>& world);
  void step_by_first_order(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces);
  void begin_metrics(const CoupledWorld<Real>& world);
  bool move_freely(const CoupledWorld<Real>& world, std::size_t index);
  void aim_surface_rows(const CoupledWorld<Real>& world, std::span<const MeshCollider> meshes);
  void aim_mesh_row(ContactRow& row, const SolidPlace& solid, double dt_s) const;
  [[nodiscard]] EndPlace place_of(const CoupledWorld<Real>& world, const JointState& joint, std::size_t which) const;
  void find_joint_rows(const CoupledWorld<Real>& world);
  void find_rows(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces);
  void solve(const CoupledWorld<Real>& world);
  double end_pass(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces);
  void rebound(const CoupledWorld<Real>& world);
  [[nodiscard]] double taken_energy_j(const CoupledWorld<Real>& world, std::size_t index);
  [[nodiscard]] Vec3d surface_velocity_of(const CoupledWorld<Real>& world, const ContactRow& row) const;
  void store(const CoupledWorld<Real>& world);
  void note(const CoupledWorld<Real>& world) const;

  std::vector<Body> bodies_;
  std::vector<SolidPlace> solids_;    // rigid bodies, then colliders
  std::vector<Vec3d> joints_left_m_;  // of each joint's error, at the substep's end
  std::vector<SurfaceBody>* surfaces_ = nullptr;
  std::vector<ContactRow> rows_;
  std::vector<ContactRow> warm_;  // of the pass before, by key
  std::vector<RowGroup> groups_;
  std::vector<Response> responses_;  // soft bodies, rigid ones, colliders, the world
  std::vector<std::uint8_t> yields_;
  std::vector<Vec3d> rigid_velocities_m_s_, rigid_turnings_rad_s_;  // of the pass before
  ImplicitSolver<Real> solver_;
  std::vector<Vec3d> x_, residual_;
  RowCounts counts_;
};

}  // namespace pneuma::physics
