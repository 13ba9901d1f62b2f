// Collision detection and response, between integration and move (the paper's step 5, section 3.5).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics/contact/contact_bounds.h"
#include "physics/contact/contact_note.h"
#include "physics/contact/contact_soft.h"
#include "physics/contact/contact_solid.h"
#include "physics/contact/coupled_step.h"
#include "physics/contact/joint_contacts.h"
#include "physics/contact/surface_contacts.h"
#include "physics/machine/profile.h"
#include "physics/machine/workers.h"
#include "physics/rigid/contact_surface.h"
#include "physics/rigid/rigid_contacts.h"
#include "physics/rigid/rigid_solver.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// The world of one substep, between its bodies' free motion and their moves.
template <class Real>
struct ContactWorld {
  std::span<SoftState<Real>> soft;
  std::span<RigidState> rigid;
  std::span<const ColliderState> colliders;
  Surroundings surroundings;
  double dt_s = 0.0;
  bool is_first_of_tick = true;  // the substep: it starts from nothing
  // Where the method is implicit, one a soft body: its tables, and its velocities before the substep (of sleepers
  // none).
  std::span<ImplicitTables<Real>> tables = {};
  std::span<const std::vector<Vec3<Real>>> start_m_s = {};
  std::optional<StageAccuracy> first_order = {};  // of a method that is not implicit Euler: how to step by that
  std::span<JointState> joints = {};              // those that break are marked
  std::span<ContactNotes> notes = {};             // one a soft body, to which what was answered is appended; or none

  [[nodiscard]] bool is_implicit() const { return !start_m_s.empty(); }
};

/// Finds and answers the contacts of one world. It holds nothing but scratch between substeps, so that a steady world
/// allocates nothing; a fresh one gives the same bits, and is needed where bodies come, go or are put elsewhere.
template <class Real>
class Contacts {
 public:
  /// Cuts the moves `dr` and changes the velocities of whatever would meet in this substep. x stays; a rigid body's
  /// pose changes only to undo an overlap, to be cut at an impact, or to follow its parabola in free flight. Call
  /// accelerate_rigid_bodies before it and move_solids after it. Same bits for any number of workers. Frozen bodies are
  /// left out. Those asleep stay where they are, and wake when they are touched. With one soft body and no solid, or
  /// with nobody awake, nothing is computed.
  void resolve(const ContactWorld<Real>& world, Workers& workers, Profile* profile);

  /// What the rows of all substeps so far came to.
  [[nodiscard]] RowCounts row_counts() const { return surfaces_.counts() + coupled_.counts() + joints_.counts(); }
  /// Adds the bytes held for each stage.
  void add_bytes(Profile& profile) const;

 private:
  void fit(const SoftState<Real>& body, BodyBounds& bounds) const;
  void meet_surfaces(const ContactWorld<Real>& world, const SubstepPhysics& physics);
  void meet_bounding_volumes(const ContactWorld<Real>& world, const SubstepPhysics& physics, Workers& workers,
                             Profile* profile);
  void meet_solids(const ContactWorld<Real>& world, const SubstepPhysics& physics, Workers& workers);
  void meet_coupled(const ContactWorld<Real>& world, const SubstepPhysics& physics);
  void hold_joints(const ContactWorld<Real>& world, Profile* profile);
  [[nodiscard]] ContactNotes* notes_of(std::size_t body) const { return notes_.empty() ? nullptr : &notes_[body]; }
  void refit_stale(std::span<SoftState<Real>> soft);
  void wake_hit_pairs(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, const SubstepPhysics& physics);
  void wake_near_rigid(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, const SubstepPhysics& physics);
  /// Calls work(0) to work(count - 1): on the workers where there is enough to do.
  template <class Work>
  void for_each(Workers& workers, std::size_t count, const Work& work);

  std::vector<BodyBounds> bounds_;          // one a soft body; sleepers keep theirs
  std::vector<Aabb<double>> swept_;         // likewise, their swept boxes side by side
  std::vector<std::uint8_t> soft_touched_;  // likewise: by another's surface, in this substep
  SurfaceContacts<Real> surfaces_;
  CoupledStep<Real> coupled_;
  JointContacts<Real> joints_;
  std::vector<std::uint32_t> order_;  // of the sweep
  std::vector<SoftPair> pairs_;
  std::vector<std::vector<std::uint32_t>> near_;  // one a pair under way: the vertices of a that may touch b
  std::vector<VertexHit> hits_;                   // of the pair under way
  std::vector<SolidMove> collider_moves_;
  std::vector<std::uint8_t> rigid_touched_;  // by a soft body in this substep
  std::vector<RigidContact> rigid_near_;
  RigidSolver rigid_solver_;
  std::size_t vertices_ = 0;
  std::span<ContactNotes> notes_;  // of the substep under way
};

}  // namespace pneuma::physics
