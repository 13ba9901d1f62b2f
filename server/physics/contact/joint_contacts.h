// Joints of bodies that their step did not solve for, and of rigid bodies among each other: answered once a substep,
// between free motion and contact.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "physics/contact/groups.h"
#include "physics/contact/joint.h"
#include "physics/contact/response.h"

namespace pneuma::physics {

template <class Real>
class JointContacts {
 public:
  /// Holds the joints, or those without soft bodies only, by changes of v and dr of soft bodies and of the velocities
  /// of rigid ones. Marks those that broke.
  void answer(std::span<JointState> joints, bool only_solid, std::span<SoftState<Real>> soft,
              std::span<RigidState> rigid, std::span<const ColliderState> colliders, double dt_s);

  [[nodiscard]] const RowCounts& counts() const { return counts_; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  /// What the joints of a rigid body pull it by.
  struct Pull {
    double impulse_n_s = 0.0;
    Vec3d by_arm = Vec3d::Zero();
  };
  [[nodiscard]] EndPlace place_of(const JointState& joint, std::size_t which, std::span<SoftState<Real>> soft,
                                  std::span<const RigidState> rigid, std::span<const ColliderState> colliders,
                                  double dt_s);
  void find_rows(std::span<const JointState> joints, bool only_solid, std::span<SoftState<Real>> soft,
                 std::span<const RigidState> rigid, std::span<const ColliderState> colliders, double dt_s);
  void slow_unresolved(std::span<RigidState> rigid) const;
  std::uint64_t solve(std::span<const SoftState<Real>> soft, std::span<const RigidState> rigid);
  bool find_rope_stiffness(std::span<const JointState> joints, double dt_s);
  bool find_turning_stiffness(std::size_t first, std::span<const RigidState> rigid, double dt_s);
  void find_held_vertices(std::span<const JointState> joints, bool only_solid, std::span<const SoftState<Real>> soft);

  std::vector<std::pair<std::uint32_t, std::uint32_t>> held_;  // soft body and vertex, in order
  std::vector<double> inverse_masses_1_kg_;                    // one each
  std::vector<Vec3d> changes_m_s_;                             // likewise
  std::vector<Pull> pulls_;                                    // one a rigid body
  std::vector<double> stiffness_kg_m2_;                        // likewise: against turning, times the substep's square
  std::vector<double> rope_softness_1_kg_;                     // one a joint: of the row across it; 0: it has none
  std::vector<ContactRow> rows_;
  std::vector<RowGroup> groups_;
  std::vector<std::uint8_t> yields_;
  std::vector<Response> responses_;  // soft bodies, rigid ones, the rest
  RowCounts counts_;
};

}  // namespace pneuma::physics
