// The solids of one group of bodies that answer by the masses of their vertices, as its rows see them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/contact_world.h"
#include "physics/contact/lumped_solver.h"
#include "physics/contact/row.h"
#include "physics/contact/span_solids.h"
#include "physics/contact/surface_body.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {

/// Rows are found once a span. In each substep they are measured again, where the solid is then. What lies over one
/// face of a box, or at a wall, is measured from that face. Other vertices are measured from the nearest point of the
/// shape. An edge over a rim is measured at its deepest point, and a face over a corner by what of it is there.
template <class Real>
class LumpedSolids {
 public:
  /// Takes the rows of a body with a solid, as the span begins. `border_m`: see SpanSolids::Meeting.
  void add(const SpanSolid& solid, const SurfaceBody& surface, double border_m, std::span<const ContactRow> rows);

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

  /// Forgets the rows and their solids.
  void clear();

  [[nodiscard]] std::size_t bytes() const;

 private:
  enum class By : std::uint8_t { plane, shape, edge, face };
  // A plane of a solid that rows are of.
  struct Plane {
    std::uint32_t solid = 0;
    Vec3d normal_local = Vec3d::UnitY();
    double level_m = 0.0;  // along it
    // In the world, in the substep under way, and where that would end.
    Vec3d normal = Vec3d::UnitY(), end_normal = Vec3d::UnitY();
    double at_m = 0.0, end_m = 0.0;
  };
  // An edge over a rim, or a face over a knob, in the solid's frame.
  struct Feature {
    Vec3d normal_local = Vec3d::UnitY();  // as last measured
    Vec3d point_local = Vec3d::Zero();    // likewise
    double slack_m = 0.0;                 // an edge that goes no deeper than this past its ends has no row
    Vec3d knob_local = Vec3d::Zero();     // that a face lies on
    double radius_m = 0.0;                // the knob's
    double through_m = 0.0;               // by which it may have gone through the face
    bool along_normal = false;            // of the face
  };
  struct Track {
    std::uint32_t solid = 0;
    std::uint32_t index = 0;  // of its plane or its feature
    By by = By::shape;
    double offset_m = 0.0;  // of the thickness
    Vec3d velocity_m_s = Vec3d::Zero();
  };

  // A point of the skin as seen from the solid.
  struct Place {
    Vec3d normal;
    Vec3d arm;  // of the solid's point, from its centre
    double gap_m;
  };

  static void track_face(const ContactRow& row, const SurfaceBody& surface, const SpanSolid& solid, double offset_m,
                         Feature& feature);
  [[nodiscard]] bool find_touch(const Track& track, const SpanSolid& solid, std::size_t row, LumpedSolver& solver,
                                const LumpedSolver::Values& places_m);
  static void find_way_in(const Track& track, const SpanSolid& solid, const Vec3d& point, const Vec3d& move_m,
                          Place& at, double& end_m);
  [[nodiscard]] Place place_at(const Track& track, const Vec3d& point) const;
  [[nodiscard]] Place place_at_end(const Track& track, const Vec3d& point) const;
  [[nodiscard]] double gap_at_end_m(const Track& track, const Vec3d& point) const;
  [[nodiscard]] static Place place_on(const Vec3d& normal, double level_m, const Frame& at, const Vec3d& point);
  [[nodiscard]] Place place_of(const Track& track, const SpanSolid& solid, const Frame& at, const Vec3d& point) const;
  [[nodiscard]] std::uint32_t plane_of(std::uint32_t solid, const Vec3d& normal_local, double level_m);
  void move_solids(const ContactWorld<Real>& world);
  void track(const ContactRow& row, const SurfaceBody& surface, std::uint32_t solid, double border_m);

  std::vector<SpanSolid> solids_;
  std::vector<Plane> planes_;
  std::vector<Feature> features_;
  std::vector<Track> tracks_;  // one a row
};

}  // namespace pneuma::physics
