// Bodies that an implicit step solved for, and all that they touch, solved together: each contact is a row, each body
// one response, and the step and its contacts come out of the same passes.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "physics/contact/coupled_passes.h"
#include "physics/contact/groups.h"
#include "physics/contact/pass_outcome.h"
#include "physics/contact/response.h"
#include "physics/contact/stopped_features.h"
#include "physics/contact/surface_contacts.h"
#include "physics/implicit/implicit_solver.h"

namespace pneuma::physics {

template <class Real>
class CoupledStep {
 public:
  /// Changes v and dr of the soft bodies in contact, and the velocities of the rigid ones. False where there are more
  /// rows than it solves: then bodies have moved freely, by implicit Euler's step at most, and nothing is answered.
  [[nodiscard]] bool run(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces);

  [[nodiscard]] const RowCounts& counts() const { return counts_; }
  /// Whether a body was on its way out of a mesh that it was put across (mesh_colliders.h).
  [[nodiscard]] bool had_ways_out() const { return had_ways_out_; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  void begin(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces);
  void load_bodies(const CoupledWorld<Real>& world);
  void load_solids(const CoupledWorld<Real>& world);
  [[nodiscard]] bool take_touching(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces);
  [[nodiscard]] bool has_too_many_rows();
  [[nodiscard]] bool is_any_driven() const;
  void stop_cut(const CoupledWorld<Real>& world, const SurfaceContacts<Real>& surfaces);
  void mark_free(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces) const;
  [[nodiscard]] double least_spacing_m() const;
  [[nodiscard]] bool step_by_first_order(const CoupledWorld<Real>& world, std::size_t index,
                                         SurfaceContacts<Real>& surfaces);
  [[nodiscard]] bool begin_metric(const CoupledWorld<Real>& world, std::size_t index);
  void move_freely(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces);
  [[nodiscard]] bool step_freely(const CoupledWorld<Real>& world, std::size_t index);
  void leave_out_failed();
  [[nodiscard]] bool solve(const CoupledWorld<Real>& world, double share);
  void list_responses(const CoupledWorld<Real>& world);
  static void warm(std::span<const WarmImpulse> all, ContactRow& row);
  void keep_impulses(std::vector<WarmImpulse>& warm) const;
  void take_answers(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces);
  [[nodiscard]] double move_as_far_as_free(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces);
  void mark_broken(const CoupledWorld<Real>& world) const;
  void store(const CoupledWorld<Real>& world);
  void note(const CoupledWorld<Real>& world) const;
  [[nodiscard]] Vec3d place_of(const Support& side) const;

  CoupledPasses passes_;
  StoppedFeatures stopped_;           // in the last pass
  std::optional<PassOutcome> least_;  // of the passes that left too much energy, the one that left least
  std::vector<std::uint8_t> rests_;   // one a soft body: on another, as the step began
  std::vector<RowGroup> groups_;
  std::vector<Response> responses_;  // soft bodies, rigid ones, colliders, the world
  std::vector<std::uint8_t> yields_;
  std::vector<std::size_t> sides_;  // one a soft body: the rows that name it
  ImplicitSolver<Real> solver_;
  std::vector<Vec3d> x_, residual_;
  RowCounts counts_;
  bool had_ways_out_ = false;
};

}  // namespace pneuma::physics
