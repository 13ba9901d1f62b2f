// Collision detection and response, between integration and move (the paper's step 5, section 3.5).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/contact_bounds.h"
#include "physics/contact/contact_note.h"
#include "physics/contact/contact_soft.h"
#include "physics/contact/contact_solid.h"
#include "physics/machine/profile.h"
#include "physics/machine/workers.h"
#include "physics/rigid/contact_surface.h"
#include "physics/rigid/rigid_contacts.h"
#include "physics/rigid/rigid_solver.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// Finds and answers the contacts of one world. It holds nothing but scratch between substeps, so that a steady world
/// allocates nothing; a fresh one gives the same bits, and is needed where bodies come, go or are put elsewhere.
template <class Real>
class Contacts {
 public:
  /// Cuts the moves `dr` and changes the velocities of whatever would meet in this substep. x stays; a rigid body's
  /// pose changes only to undo an overlap, to be cut at an impact, or to follow its parabola in free flight. Call
  /// accelerate_rigid_bodies before it and move_solids after it. Same bits for any number of workers. Frozen bodies are
  /// left out. Those asleep stay where they are, and wake when they are touched. With one soft body and no solid, or
  /// with nobody awake, nothing is computed. `start_m_s`: the velocities before the substep, one list a body, empty for
  /// sleepers, where the method is implicit: then contact adds no energy (contact_limit.h); else no lists. `notes`: one
  /// list a body, to which what was answered is appended; or none.
  void resolve(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, std::span<const ColliderState> colliders,
               std::span<const std::vector<Vec3<Real>>> start_m_s, const Surroundings& surroundings, double dt_s,
               std::span<ContactNotes> notes, Workers& workers, Profile* profile);

  /// Adds the bytes held for each stage.
  void add_bytes(Profile& profile) const;

 private:
  void fit(const SoftState<Real>& body, BodyBounds& bounds) const;
  void meet_soft_bodies(std::span<SoftState<Real>> soft, const SubstepPhysics& physics, Workers& workers,
                        Profile* profile);
  void meet_solids(std::span<SoftState<Real>> soft, std::span<RigidState> rigid,
                   std::span<const ColliderState> colliders, const SubstepPhysics& physics, Workers& workers);
  [[nodiscard]] ContactLimit<Real>* limit_of(const SoftState<Real>& body);
  [[nodiscard]] std::span<const Vec3<Real>> start_of(std::size_t body) const;
  [[nodiscard]] ContactNotes* notes_of(std::size_t body) const { return notes_.empty() ? nullptr : &notes_[body]; }
  void refit_stale(std::span<SoftState<Real>> soft);
  void wake_hit_pairs(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, const SubstepPhysics& physics);
  void wake_near_rigid(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, const SubstepPhysics& physics);
  /// Calls work(0) to work(count - 1): on the workers where there is enough to do.
  template <class Work>
  void for_each(Workers& workers, std::size_t count, const Work& work);

  std::vector<BodyBounds> bounds_;    // one a soft body; sleepers keep theirs
  std::vector<std::uint32_t> order_;  // of the sweep
  std::vector<SoftPair> pairs_;
  std::vector<std::vector<std::uint32_t>> near_;  // one a pair under way: the vertices of a that may touch b
  std::vector<VertexHit> hits_;                   // of the pair under way
  std::vector<SolidMove> collider_moves_;
  std::vector<std::uint8_t> rigid_touched_;  // by a soft body in this substep
  std::vector<RigidContact> rigid_near_;
  RigidSolver rigid_solver_;
  std::size_t vertices_ = 0;
  std::span<const std::vector<Vec3<Real>>> start_m_s_;  // of the substep under way
  std::span<ContactNotes> notes_;                       // and where it is noted
  ContactLimit<Real> limit_;
};

}  // namespace pneuma::physics
