// Solids as the rows of bodies that answer by the masses of their vertices see them, over a span of substeps.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/contact_world.h"
#include "physics/contact/lumped_solver.h"
#include "physics/contact/row.h"
#include "physics/contact/solid_rows.h"
#include "physics/contact/surface_body.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {

/// Rows are found once a span. In each substep they are measured again where the solid is then: what lies over one face
/// of a box, or at a wall, by that face; other vertices by the nearest point of the shape; an edge over a rim by its
/// deepest point, and a face over a corner by what of it is there.
template <class Real>
class LumpedSolids {
 public:
  /// Appends the rows of a span of so many substeps. The surfaces of `soft` are loaded with where they are and where
  /// they would end. Responses of solids begin at `first`: rigid bodies, then colliders.
  void find_rows(const ContactWorld<Real>& world, std::span<const SurfaceBody> surfaces,
                 std::span<const std::uint32_t> soft, std::uint32_t first, double substeps,
                 std::vector<ContactRow>& rows);

  /// Of each row of the solver: its gap, the gap that its move would leave, and the speed at which it opens.
  struct Gaps {
    std::span<double> start_m, end_m, opening_m_s;
  };
  /// Measures the rows, which begin at `first_row` of the solver, in the substep under way, whose values are loaded but
  /// for those of the solids' points. Sets these, the solver's normals and the gaps.
  void measure(const ContactWorld<Real>& world, std::size_t first_row, LumpedSolver& solver,
               const LumpedSolver::Values& places_m, LumpedSolver::Values& velocities_m_s,
               LumpedSolver::Values& moves_m, const Gaps& gaps);

  /// Where a vertex comes to the solid of a row after a share of its move, and slides along it by `slide_m` then: its
  /// move. The solid is a collider.
  [[nodiscard]] Vec3d move_to_slide_m(std::size_t row, const Vec3d& place, const Vec3d& move_m, double share,
                                      const Vec3d& slide_m) const;

  /// Where a point stands to the collider of a row once that has moved: its gap, and the normal there.
  struct EndGap {
    Vec3d normal;
    double gap_m;
  };
  [[nodiscard]] EndGap end_gap(std::size_t row, const Vec3d& point) const;

  /// The solid of a row, counted from the first row of one.
  [[nodiscard]] bool is_rigid(std::size_t row) const { return solids_[tracks_[row].solid].is_rigid; }
  /// Among rigid bodies, or among colliders.
  [[nodiscard]] std::uint32_t index(std::size_t row) const { return solids_[tracks_[row].solid].index; }
  /// Of the point of the solid that the row meets, as last measured.
  [[nodiscard]] const Vec3d& velocity_m_s(std::size_t row) const { return tracks_[row].velocity_m_s; }

  /// Where a span ends: stops vertices that no row was found for, and that would end in a solid or have gone through
  /// one, at its surface. What the span moves bodies by is in the surfaces. True where there was one.
  bool stop_missed(const ContactWorld<Real>& world, std::span<const SurfaceBody> surfaces,
                   std::span<const std::uint32_t> soft);

  /// Forgets the rows and their solids.
  void clear();

  [[nodiscard]] std::size_t bytes() const;

 private:
  static constexpr std::uint32_t no_vertex = 0xffff'ffff;
  static constexpr std::uint8_t all_walls = 0xff;
  enum class By { plane, shape, edge, face };
  struct Solid {
    const Shape* shape = nullptr;
    const Surface* surface = nullptr;
    bool is_rigid = false;
    std::uint32_t index = 0;
    bool is_still = false;  // and so are its planes
    bool is_placed = false;
    Frame start;  // of the span
    Frame at;     // in the substep under way
    Frame end;    // and where it would end
    Vec3d velocity = Vec3d::Zero();
    Vec3d angular_velocity = Vec3d::Zero();
  };
  // A plane of a solid that rows are of.
  struct Plane {
    std::uint32_t solid = 0;
    Vec3d normal_local = Vec3d::UnitY();
    double level_m = 0.0;  // along it
    // In the world, in the substep under way, and where that would end.
    Vec3d normal = Vec3d::UnitY(), end_normal = Vec3d::UnitY();
    double at_m = 0.0, end_m = 0.0;
  };
  struct Track {
    std::uint32_t solid = 0;
    std::uint32_t soft = 0;
    std::uint32_t vertex = no_vertex;  // that the row is of; none of an edge or a face
    std::uint8_t walls = all_walls;    // of a plane or a room: a bit, the one that the row is with
    By by = By::shape;
    std::uint32_t plane = 0;
    double offset_m = 0.0;                // of the thickness
    Vec3d normal_local = Vec3d::UnitY();  // of an edge or a face, in the solid's frame, as last measured
    Vec3d point_local = Vec3d::Zero();    // likewise
    double slack_m = 0.0;                 // an edge that goes no deeper than this past its ends has no row
    Vec3d knob_local = Vec3d::Zero();     // that a face lies on
    double radius_m = 0.0;                // the knob's
    double through_m = 0.0;               // by which it may have gone through the face
    bool along_normal = false;            // of the face
    Vec3d velocity_m_s = Vec3d::Zero();
  };

  // A point of the skin as seen from the solid.
  struct Place {
    Vec3d normal;
    Vec3d arm;  // of the solid's point, from its centre
    double gap_m;
  };

  void take_solids(const ContactWorld<Real>& world);
  void track_face(const ContactRow& row, const SurfaceBody& surface, const Solid& solid, Track& track) const;
  [[nodiscard]] static bool find_touch(Track& track, const Solid& solid, std::size_t row, LumpedSolver& solver,
                                       const LumpedSolver::Values& places_m);
  static void find_way_in(const Track& track, const Solid& solid, const Vec3d& point, const Vec3d& move_m, Place& at,
                          double& end_m);
  [[nodiscard]] Place place_at(const Track& track, const Vec3d& point) const;
  [[nodiscard]] Place place_at_end(const Track& track, const Vec3d& point) const;
  [[nodiscard]] static Place place_on(const Vec3d& normal, double level_m, const Frame& at, const Vec3d& point);
  [[nodiscard]] static Place place_of(const Track& track, const Solid& solid, const Frame& at, const Vec3d& point);
  [[nodiscard]] std::uint32_t plane_of(std::uint32_t solid, const Vec3d& normal_local, double level_m);
  void move_solids(const ContactWorld<Real>& world);
  [[nodiscard]] bool stop_missed(SoftState<Real>& state, const SurfaceBody& surface, const Solid& solid) const;
  void track(const ContactRow& row, const SurfaceBody& surface, std::uint32_t solid);

  std::vector<Solid> solids_;
  std::vector<SolidPlace> places_;
  std::vector<Plane> planes_;
  std::vector<Track> tracks_;  // one a row
  SolidRowFinder finder_;
  std::vector<std::uint8_t> has_row_;  // scratch, one a vertex: with which walls
};

}  // namespace pneuma::physics
