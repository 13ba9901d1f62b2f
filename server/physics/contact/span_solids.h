// The solids that bodies meet which answer by the masses of their vertices. Rows are found as a span of substeps
// begins; what they missed is stopped where it ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/contact_world.h"
#include "physics/contact/row.h"
#include "physics/contact/solid_rows.h"
#include "physics/contact/surface_body.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {

/// A rigid body or a collider.
struct SpanSolid {
  const Shape* shape = nullptr;
  const Surface* surface = nullptr;
  bool is_rigid = false;
  std::uint32_t index = 0;  // among rigid bodies, or among colliders
  bool is_still = false;
  bool is_placed = false;
  Frame start;  // of the span
  Frame at;     // in the substep under way
  Frame end;    // and where it would end
  Vec3d velocity = Vec3d::Zero();
  Vec3d angular_velocity = Vec3d::Zero();

  /// To where the substep finds it.
  void move(std::span<const RigidState> rigid, std::span<const ColliderState> colliders, double dt_s);
};

template <class Real>
class SpanSolids {
 public:
  /// The rows of one body with one solid.
  struct Meeting {
    std::uint32_t soft = 0;
    std::uint32_t solid = 0;
    std::size_t first_row = 0;
    std::size_t row_count = 0;
    double border_m = 0.0;  // what is this far within a face's border may stay over it for the span
  };

  /// Appends the rows of a span of so many substeps, meeting after meeting. The surfaces of `soft` are loaded with
  /// where they are and where they would end. Responses of solids begin at `first`: rigid bodies, then colliders.
  /// Whoever is crowded (crowding.h) is marked, and has no rows.
  void find_rows(const ContactWorld<Real>& world, std::span<const SurfaceBody> surfaces,
                 std::span<const std::uint32_t> soft, std::uint32_t first, double substeps,
                 std::vector<ContactRow>& rows);
  /// By body, then by solid.
  [[nodiscard]] std::span<const Meeting> meetings() const { return meetings_; }
  /// Rigid bodies, then colliders, as the span began.
  [[nodiscard]] const SpanSolid& solid(std::uint32_t index) const { return solids_[index]; }

  /// One a collider: whether it never moves.
  [[nodiscard]] std::span<const std::uint8_t> is_still() const { return is_still_; }

  /// Where a span ends: stops vertices that no row was found for, and that would end in a solid or have gone through
  /// one, at its surface. What the span moves bodies by is in the surfaces. True where there was one.
  bool stop_missed(const ContactWorld<Real>& world, std::span<const SurfaceBody> surfaces,
                   std::span<const std::uint32_t> soft);

  /// Forgets the solids and what met them.
  void clear();

  [[nodiscard]] std::size_t bytes() const;

 private:
  static constexpr std::uint8_t all_walls = 0xff;
  // A vertex that has a row.
  struct Mark {
    std::uint32_t vertex = 0;
    std::uint8_t walls = all_walls;  // of a plane or a room: a bit, the one that the row is with
  };

  void take_solids(const ContactWorld<Real>& world);
  [[nodiscard]] bool meets(const ContactWorld<Real>& world, const SurfaceBody& surface, std::uint32_t soft,
                           std::uint32_t index) const;
  void note_meeting(std::uint32_t soft, std::uint32_t solid, std::size_t first_row, std::span<const ContactRow> rows);
  [[nodiscard]] bool stop_missed(SoftState<Real>& state, const SurfaceBody& surface, const SpanSolid& solid) const;

  std::vector<SpanSolid> solids_;
  std::vector<SolidPlace> places_;      // one a solid
  std::vector<std::uint8_t> is_still_;  // one a collider
  std::vector<Meeting> meetings_;
  std::vector<Mark> marks_;             // meeting after meeting
  std::vector<std::size_t> marks_end_;  // one a meeting
  std::vector<std::uint8_t> marked_;    // scratch, one a vertex: the walls that it has rows with
  SolidRowFinder finder_;
};

}  // namespace pneuma::physics
