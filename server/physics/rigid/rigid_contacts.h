// Where rigid balls, capsules, boxes and convex meshes meet each other and colliders.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/rigid/contact_surface.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// Of a rigid body's ball about its centre.
[[nodiscard]] double radius_about_centre(const Shape& shape);

/// Of that radius. Bodies at rest drift apart by round-off; what is this near still counts as a contact.
inline constexpr double rigid_margin_share = 1e-4;

inline constexpr std::uint32_t no_body = 0xffffffffU;

/// Two solids that touch or may within the substep. `normal` points from b to a.
struct RigidContact {
  std::uint32_t a = no_body;
  std::uint32_t b = no_body;   // no_body: a collider, which moves by `velocity_b`
  std::uint32_t collider = 0;  // that one's index, as whoever asks for the contacts knows it
  Vec3d velocity_b = Vec3d::Zero();
  Vec3d point = Vec3d::Zero();
  Vec3d normal = Vec3d::UnitY();
  double distance_m = 0.0;  // negative: they overlap
  double size_m = 0.0;      // the lesser radius of the two about their centres; of a collider's contact the body's
  double thin_m = 0.0;      // the least half extent of both
  double bend_m_s2 = 0.0;   // by which a turning collider's surface leaves its straight way
  ContactSurface surface;
  // While it is solved:
  Vec3d arm_a = Vec3d::Zero();
  Vec3d arm_b = Vec3d::Zero();
  bool gives_way = false;    // along the normal
  bool is_met = false;       // its group was answered before
  double closing_m_s = 0.0;  // as it was found
  double target_m_s = 0.0;   // the least normal velocity that may remain
  bool bounces = false;
  double normal_impulse_n_s = 0.0;
  Vec3d impulse_n_s = Vec3d::Zero();  // on a
};

/// Appends the contacts of body a with body b (or with a collider) that the substep may bring about: those nearer than
/// the two can come in dt_s, so that a fast body does not jump through a thin one.
void find_rigid_contacts(std::span<const RigidState> rigid, std::uint32_t a, std::uint32_t b, double dt_s,
                         std::vector<RigidContact>& contacts);
void find_collider_contacts(std::span<const RigidState> rigid, std::uint32_t a, const ColliderState& collider,
                            double dt_s, std::vector<RigidContact>& contacts);

/// Two rigid bodies, a < b, that may have contacts.
struct RigidPair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
};
/// Fills `pairs`, in order of (a, b), with every two bodies that are active and awake of which find_rigid_contacts may
/// have something to say; `order` is scratch.
void find_rigid_pairs(std::span<const RigidState> rigid, double dt_s, std::vector<std::uint32_t>& order,
                      std::vector<RigidPair>& pairs);

}  // namespace pneuma::physics
