// Rigid balls and boxes and moving colliders: their motion, and their contacts by sequential impulses.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact_surface.h"
#include "physics/state.h"

namespace pneuma::physics {

/// Neither frozen nor about to be: finite, and within the limits of speed and place. It may be asleep.
[[nodiscard]] bool is_active(const RigidState& body);

/// Of a rigid body's ball about its centre.
[[nodiscard]] double radius_about_centre(const Shape& shape);

/// Of that radius. Bodies at rest drift apart by round-off; what is this near still counts as a contact.
inline constexpr double rigid_margin_share = 1e-4;

/// Moves the rigid bodies' velocities on by gravity.
void accelerate_rigid_bodies(std::span<RigidState> rigid, const Vec3d& gravity_m_s2, double dt_s);

/// Moves rigid bodies and colliders along their velocities for dt_s. A rigid body's angular momentum about its centre
/// is kept to round-off, which bounds its energy: its spin cannot blow up at any step. A collider turns by the exact
/// exponential map. Bodies that the contact solver has moved already stay.
void move_solids(std::span<RigidState> rigid, std::span<ColliderState> colliders, double dt_s);

/// The same of one body.
void move_rigid(RigidState& body, double dt_s);

/// `orientation` after turning at a constant angular velocity (rad/s, in the world's frame); unit length.
[[nodiscard]] Quatd turned(const Quatd& orientation, const Vec3d& angular_velocity_rad_s, double dt_s);

/// R I^-1 R^T x: what an angular impulse x does to the angular velocity.
[[nodiscard]] Vec3d inverse_inertia_times(const RigidState& body, const Vec3d& x);

inline constexpr std::uint32_t no_body = 0xffffffffU;

/// Two solids that touch or may within the substep. `normal` points from b to a.
struct RigidContact {
  std::uint32_t a = no_body;
  std::uint32_t b = no_body;  // no_body: a collider, which moves by `velocity_b`
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
  double mass_normal_kg = 0.0;
  double mass_tangent_kg = 0.0;
  double target_m_s = 0.0;  // the least normal velocity that may remain
  bool bounces = false;
  double normal_impulse_n_s = 0.0;
  Vec3d tangent_impulse_n_s = Vec3d::Zero();
  double push_kg_m = 0.0;
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

/// Contacts among rigid bodies that are awake and between them and colliders: sequential impulses (Catto, "Iterative
/// Dynamics with Temporal Coherence", 2005), with overlaps undone apart from the velocities, so that undoing adds no
/// energy. Points are taken to move straight within a substep; bodies that turn too far for that, while they may touch
/// something, go through the substep in pieces, each with its own look for contacts.
class RigidSolver {
 public:
  /// `touched`: one a rigid body, set where a soft body met it in this substep (it is not in free flight then). Moves
  /// what goes in pieces, and marks it as moved.
  void solve(std::span<RigidState> rigid, std::span<const ColliderState> colliders,
             std::span<const std::uint8_t> touched, const Vec3d& gravity_m_s2, double dt_s);
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Push {
    Vec3d linear_m = Vec3d::Zero();
    Vec3d angular_rad = Vec3d::Zero();
  };
  struct Motion {
    Vec3d velocity = Vec3d::Zero();
    Vec3d angular_velocity = Vec3d::Zero();
  };
  void find_contacts(std::span<const RigidState> rigid, std::span<const ColliderState> colliders, double dt_s);
  void find_contacts_of_group(std::span<const RigidState> rigid, double dt_s);
  void prepare(std::span<const RigidState> rigid, const Vec3d& gravity_m_s2, double resting_m_s, double dt_s);
  void find_groups(std::size_t bodies);
  void solve_velocities(std::span<RigidState> rigid, double dt_s);
  void take_groups_for_pieces(std::span<RigidState> rigid, double dt_s);
  void move_in_pieces(std::span<RigidState> rigid, std::span<const ColliderState> colliders,
                      std::span<const std::uint8_t> touched, const Vec3d& gravity_m_s2, double dt_s);
  [[nodiscard]] double bend_over(std::span<const RigidState> rigid, const RigidContact& c, double dt_s) const;
  [[nodiscard]] double first_bounce_s(std::span<const RigidState> rigid) const;
  void note_pressed();
  void cut_moves(std::span<RigidState> rigid, double dt_s);
  void undo_overlaps(std::span<RigidState> rigid);

  std::vector<std::uint32_t> order_;  // of the sweep
  std::vector<RigidPair> pairs_;
  std::vector<RigidContact> contacts_;
  std::vector<Push> pushes_;           // one a body
  std::vector<std::uint32_t> groups_;  // one a body: the first of those that it is in contact with, itself included
  std::vector<double> changes_;        // of a group in this round, at its first body: moves over the contact's size
  std::vector<std::uint8_t> settled_;  // likewise
  std::vector<std::uint8_t> pressed_;  // one a body: a contact pushed it in this substep
  std::vector<Motion> before_;         // one a body: as contact found it
  std::vector<std::uint32_t> groups_in_pieces_;
  std::vector<std::uint32_t> members_;    // of the group that goes in pieces
  std::vector<ColliderState> colliders_;  // as they are when the piece begins
};

}  // namespace pneuma::physics
