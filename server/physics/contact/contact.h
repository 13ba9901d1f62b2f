// Collision detection and response, between integration and move (the paper's step 5, section 3.5).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/contact_bounds.h"
#include "physics/contact/contact_note.h"
#include "physics/contact/contact_soft.h"
#include "physics/contact/contact_world.h"
#include "physics/contact/coupled_step.h"
#include "physics/contact/joint_contacts.h"
#include "physics/contact/lumped_contacts.h"
#include "physics/contact/rigid_solver.h"
#include "physics/contact/surface_contacts.h"
#include "physics/machine/profile.h"
#include "physics/machine/room_pool.h"
#include "physics/machine/workers.h"
#include "physics/rigid/rigid_contacts.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// Finds and answers the contacts of one world. Between ticks it holds nothing but scratch, and little of that: most of
/// it worlds use in turns. A fresh one gives the same bits, and is needed where bodies come, go or are put elsewhere.
template <class Real>
class Contacts {
 public:
  /// Cuts the moves `dr` and changes the velocities of whatever would meet in this substep. x stays; a rigid body's
  /// pose changes only to undo an overlap, to be cut at an impact, or to follow its parabola in free flight. Call
  /// accelerate_rigid_bodies before it and move_solids after it. Same bits for any number of workers. Frozen bodies are
  /// left out. Those asleep stay where they are, and wake when they are touched. With one soft body and no solid, or
  /// with nobody awake, nothing is computed.
  void resolve(const ContactWorld<Real>& world);

  /// By explicit methods, before a substep's free motion: see LumpedContacts::keep_start.
  void keep_start(const SubstepContext& context, const Moving<Real>& moving);
  /// After resolve(), before anything moves: see LumpedContacts::take_back. Its moves are void where it is not 0.
  [[nodiscard]] std::uint32_t take_back(const Moving<Real>& moving);

  /// In the last substep of an implicit method: see CoupledStep::had_ways_out.
  [[nodiscard]] bool had_ways_out() const { return coupled_.had_ways_out(); }

  /// Gives back what worlds use in turns.
  void end_tick();

  /// What the rows of all substeps so far came to.
  [[nodiscard]] RowCounts row_counts() const {
    return lumped_counts_ + coupled_.counts() + joints_.counts() + rigid_solver_.counts();
  }
  /// Adds the bytes held for each stage.
  void add_bytes(Profile& profile) const;

 private:
  /// What a substep has to look for at all.
  struct Meetings {
    explicit Meetings(const ContactWorld<Real>& world);
    bool solids = false;
    bool pairs = false;     // of soft bodies
    bool surfaces = false;  // of soft bodies, with each other, themselves or meshes
    bool joints = false;
    bool any = false;
  };

  void fit(const SoftState<Real>& body, const Extents<Real>* known, BodyBounds& bounds) const;
  // In the order of the substep.
  void hold_joints(const ContactWorld<Real>& world);
  void find_bounds(const ContactWorld<Real>& world);
  void forget_touches(const ContactWorld<Real>& world);
  void meet_lumped(const ContactWorld<Real>& world);
  void meet_bounding_volumes(const ContactWorld<Real>& world);
  [[nodiscard]] bool meet_coupled(const ContactWorld<Real>& world);
  [[nodiscard]] ContactWorld<Real> without_coupling(const ContactWorld<Real>& world);
  void find_rigid_rows(const ContactWorld<Real>& world);
  void wake_all_touched(const ContactWorld<Real>& world);
  void meet_rigid_bodies(const ContactWorld<Real>& world);
  void filter_moves(const ContactWorld<Real>& world);

  void refit_stale(const ContactWorld<Real>& world);
  void wake_near_rigid(const ContactWorld<Real>& world);
  /// Calls work(0) to work(count - 1): on the workers where there is enough to do.
  template <class Work>
  void for_each(const ContactWorld<Real>& world, std::size_t count, const Work& work);

  std::vector<BodyBounds> bounds_;          // one a soft body; sleepers keep theirs
  std::vector<Aabb<double>> swept_;         // likewise, their swept boxes side by side
  std::vector<std::uint8_t> soft_touched_;  // likewise: by another's surface, in this substep
  SurfaceContacts<Real> surfaces_;
  Borrowed<LumpedContacts<Real>> lumped_;  // within a tick
  RowCounts lumped_counts_;
  CoupledStep<Real> coupled_;
  JointContacts<Real> joints_;
  std::vector<std::uint32_t> order_;  // of the sweep
  std::vector<SoftPair> pairs_;
  std::vector<std::vector<std::uint32_t>> near_;  // one a pair under way: the vertices of a that may touch b
  std::vector<VertexHit> hits_;                   // of the pair under way
  std::vector<std::uint8_t> rigid_solved_;        // together with soft bodies
  std::vector<std::uint8_t> rigid_touched_;       // in this substep, before rigid bodies met each other
  std::vector<RigidContact> rigid_near_;
  RigidSolver rigid_solver_;
  std::vector<ContactRow> rigid_rows_;  // that an implicit step solves with its own
  std::size_t vertices_ = 0;
  Stage surface_stage_ = Stage::soft_contact;  // under which the contacts of soft bodies' surfaces are counted
};

}  // namespace pneuma::physics
