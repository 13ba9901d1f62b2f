// Rigid bodies among themselves and with colliders: their contacts are rows too.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/contact_note.h"
#include "physics/contact/groups.h"
#include "physics/contact/response.h"
#include "physics/contact/row.h"
#include "physics/rigid/rigid_contacts.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// Contacts among rigid bodies that are awake and between them and colliders. Overlaps are undone apart from the
/// velocities, so that undoing adds no energy. Points are taken to move straight within a substep; bodies that turn too
/// far for that, while they may touch something, go through the substep in pieces, each with its own look for contacts.
/// Whoever is crowded (crowding.h) is marked, and takes no part.
class RigidSolver {
 public:
  /// Appends the rows of contacts that the substep may bring about, for a step that solves them together with those of
  /// soft bodies: as its rigid bodies would go without contact. Bodies have the responses from `first` on, then
  /// colliders. Groups that go in pieces or bounce have none.
  void append_rows(std::span<RigidState> rigid, std::span<const ColliderState> colliders, const Vec3d& gravity_m_s2,
                   double dt_s, std::uint32_t first, std::vector<ContactRow>& rows);
  /// Of the last look for contacts, one a body: the first of those that it is in contact with, itself included.
  [[nodiscard]] std::span<const std::uint32_t> groups() const { return groups_; }

  /// What a substep has done to each rigid body before.
  struct Met {
    std::span<const std::uint8_t> touched;  // it is not in free flight
    std::span<const std::uint8_t> solved;   // its rows of append_rows were solved
  };
  /// A group whose rows were solved is answered again only where an approach was left in it. Moves what goes in pieces,
  /// and marks it as moved. What pressed what is added to `touches`, if there is one.
  void solve(std::span<RigidState> rigid, std::span<const ColliderState> colliders, const Met& met,
             const Vec3d& gravity_m_s2, double dt_s, TouchTally* touches);
  [[nodiscard]] const RowCounts& counts() const { return counts_; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Motion {
    Vec3d velocity = Vec3d::Zero();
    Vec3d angular_velocity = Vec3d::Zero();
  };
  void leave_out_met(std::span<const RigidState> rigid, std::span<const std::uint8_t> solved, double dt_s);
  void begin(std::span<RigidState> rigid, std::span<const ColliderState> colliders, const Vec3d& gravity_m_s2,
             double dt_s);
  void find_contacts(std::span<RigidState> rigid, std::span<const ColliderState> colliders, double dt_s);
  void find_contacts_of(std::span<const RigidState> rigid, std::uint32_t a, std::span<const ColliderState> colliders,
                        double dt_s);
  void find_contacts_of_group(std::span<RigidState> rigid, double dt_s);
  void prepare(std::span<const RigidState> rigid, const Vec3d& gravity_m_s2, double resting_m_s, double dt_s,
               bool is_piece);
  void find_groups(std::size_t bodies);
  void load_rows(std::span<const RigidState> rigid);
  void aim_row(std::span<const RigidState> rigid, ContactRow& row) const;
  void soften(std::span<const RigidState> rigid, ContactRow& row) const;
  void begin_again(std::span<const RigidState> rigid, ContactRow& row);
  void solve_velocities(std::span<RigidState> rigid, double dt_s);
  void take_groups_for_pieces(std::span<RigidState> rigid, double dt_s);
  void move_in_pieces(std::span<RigidState> rigid, std::span<const ColliderState> colliders,
                      std::span<const std::uint8_t> touched, const Vec3d& gravity_m_s2, double dt_s);
  [[nodiscard]] double bend_over(std::span<const RigidState> rigid, const RigidContact& c, double dt_s) const;
  [[nodiscard]] double first_bounce_s(std::span<const RigidState> rigid) const;
  void note_pressed();
  void find_shifts(std::span<const RigidState> rigid, double dt_s);
  [[nodiscard]] Vec3d shift_between_m(const RigidContact& c) const;
  void cut_moves(std::span<RigidState> rigid) const;
  /// In this share of a substep.
  void undo_overlaps(std::span<RigidState> rigid, double share);

  std::vector<std::uint32_t> order_;  // of the sweep
  std::vector<RigidPair> pairs_;
  std::vector<RigidContact> contacts_;
  std::vector<std::uint32_t> groups_;  // one a body: the first of those that it is in contact with, itself included
  std::vector<ContactRow> rows_;       // of contacts_; key.features is the contact's place
  JoinedBodies joined_;                // scratch of find_groups
  std::vector<RowGroup> row_groups_;
  std::vector<std::uint8_t> yields_;
  std::vector<double> still_m_s_;      // scratch, one a row of a group: what it reaches without a bounce
  std::vector<Response> responses_;    // one a rigid body, and of all colliders
  std::vector<Vec3d> shifts_m_;        // one a body: what ends its substep where it bounced
  std::vector<std::uint8_t> pressed_;  // one a body: a contact pushed it in this substep
  std::vector<Motion> before_;         // one a body: as contact found it
  std::vector<std::uint32_t> groups_in_pieces_;
  std::vector<std::uint32_t> members_;    // of the group that goes in pieces
  std::vector<ColliderState> colliders_;  // as they are when the piece begins
  TouchTally* touches_ = nullptr;         // of the solve under way
  RowCounts counts_;
};

}  // namespace pneuma::physics
