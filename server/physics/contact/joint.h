// Joints as live state, and the rows that they make.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics/contact/row.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// One end of a joint, found among the bodies.
struct JointEnd {
  Anchor::Of of = Anchor::Of::world;
  std::uint32_t index = 0;  // among those of its kind
  Support support;          // of a soft body: its vertices and their weights
};

struct JointState {
  Joint joint;
  std::array<JointEnd, 2> ends;
  bool has_soft = false;  // joints tie it to a soft body, directly or through others
  // As they were when the joint was made:
  std::array<Vec3d, 2> points_m{Vec3d::Zero(),
                                Vec3d::Zero()};  // not of soft bodies; in the body's frame or the world's
  Quatd turn = Quatd::Identity();                // of the first, seen from the second
  bool broken = false;                           // in the substep under way
};

/// Makes a joint of bodies as they are now.
template <class Real>
[[nodiscard]] JointState make_joint(const Joint& joint, std::span<const SoftState<Real>> soft,
                                    std::span<const RigidState> rigid, std::span<const ColliderState> colliders);

/// Finds the ends of a joint that goes on among bodies that may stand in another order now.
template <class Real>
void find_ends(JointState& joint, std::span<const SoftState<Real>> soft, std::span<const RigidState> rigid,
               std::span<const ColliderState> colliders);

/// Numbers the bodies that joints tie together.
template <class Real>
void tie_bodies(std::span<JointState> joints, std::span<SoftState<Real>> soft, std::span<RigidState> rigid);

/// Where an end is before the joint acts.
struct EndPlace {
  Support support;
  bool yields = false;            // it is not fixed, frozen or asleep
  Vec3d at = Vec3d::Zero();       // m
  Vec3d ahead_m = Vec3d::Zero();  // of a soft body: how far its free motion takes the point
  // Of a solid:
  Vec3d centre = Vec3d::Zero();
  Quatd orientation = Quatd::Identity();
  Vec3d centre_ahead_m = Vec3d::Zero();
  Vec3d turn_ahead_rad = Vec3d::Zero();
  double kept_m = 0.0;  // of bodies that contact keeps apart: the room around them

  [[nodiscard]] Vec3d ahead_at(const Vec3d& point) const {
    return support.count > 0 ? ahead_m : Vec3d(centre_ahead_m + turn_ahead_rad.cross(point - centre));
  }
};

/// Of end number `which`, on a solid with this pose and motion.
[[nodiscard]] EndPlace place_of_solid(const JointState& joint, std::size_t which, const Vec3d& centre,
                                      const Quatd& orientation, const Vec3d& velocity_m_s, const Vec3d& turning_rad_s,
                                      double dt_s);

/// The room that contact keeps around end number `which`, where it keeps the two ends apart: of a soft body and another
/// body.
template <class Real>
[[nodiscard]] double kept_of_end(const JointState& joint, std::size_t which, std::span<const SoftState<Real>> soft,
                                 std::span<const RigidState> rigid, std::span<const ColliderState> colliders);

/// Whether the joint's ends are further apart than its work leaves them, as a scene or an edit may put them. To bring
/// them together takes energy that the bodies do not have.
template <class Real>
[[nodiscard]] bool is_apart(const JointState& joint, std::span<const SoftState<Real>> soft,
                            std::span<const RigidState> rigid, std::span<const ColliderState> colliders);

/// The substep, as joints see it.
struct JointStep {
  double dt_s = 0.0;
  bool repairs = true;  // ends that are apart come together
};

/// What is left of a joint's error at the end of a substep that starts with its ends at these places: 0, or where the
/// ends are further apart than a bounded speed closes in a substep, the rest.
[[nodiscard]] Vec3d error_left_m(const JointState& joint, const EndPlace& first, const EndPlace& second,
                                 const JointStep& step);

/// Appends the rows of joint number `index`.
void append_joint_rows(const JointState& joint, std::uint32_t index, const EndPlace& first, const EndPlace& second,
                       const Vec3d& left_m, const JointStep& step, std::vector<ContactRow>& rows);

/// Of a row: the number of the joint that it is a part of; nothing of a contact.
[[nodiscard]] std::optional<std::uint32_t> joint_of(const ContactRow& row);

/// Whether a row took as much as it can.
[[nodiscard]] bool has_given_way(const ContactRow& row);

}  // namespace pneuma::physics
