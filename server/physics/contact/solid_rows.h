// The rows of soft bodies against solids: colliders and rigid bodies.
#pragma once

#include <span>
#include <vector>

#include "physics/contact/row.h"
#include "physics/contact/surface_body.h"
#include "physics/rigid/contact_surface.h"
#include "physics/scene/shape.h"
#include "physics/scene/shape_parts.h"

namespace pneuma::physics {

/// Of the mean distance of a body's vertices: what ends no nearer than this needs no row.
inline constexpr double solid_slack_share = 0.02;

/// A soft body as its rows with solids see it.
struct SkinMove {
  const Mesh* mesh = nullptr;
  const Surface* surface = nullptr;
  double spacing_m = 0.0;
  std::span<const double> inverse_masses_1_kg;  // one a vertex; 0 of pinned ones
  std::span<const Vec3d> start;                 // where the substep found it, m
  std::span<const Vec3d> from;                  // where the pass finds it
  std::span<const Vec3d> to;                    // where it would end

  [[nodiscard]] Vec3d move_m(std::uint32_t vertex) const { return to[vertex] - from[vertex]; }
};
[[nodiscard]] inline SkinMove skin_move_of(const SurfaceBody& body, std::span<const Vec3d> start) {
  return {
      body.topology->mesh.get(), &body.surface, body.spacing_m, body.inverse_masses_1_kg, start, body.from, body.to};
}

/// A solid as the rows of one pass see it.
struct SolidPlace {
  const Shape* shape = nullptr;
  const Surface* surface = nullptr;
  std::uint32_t response = 0;
  bool yields = false;                     // so that pinned vertices push it
  Frame at;                                // where the pass finds it
  Vec3d velocity = Vec3d::Zero();          // m/s, without contact, over the whole substep
  Vec3d angular_velocity = Vec3d::Zero();  // rad/s
  Vec3d ahead = Vec3d::Zero();             // m/s: of that, what does not lie behind it yet
  Vec3d ahead_turning = Vec3d::Zero();     // rad/s
  Box way;                                 // about all of it in the pass (set_way)
};

/// Sets `way` from what is ahead. That of a plane or a room is everywhere, that of a mesh nowhere.
void set_way(SolidPlace& solid, double dt_s);

/// Whether the body may meet the solid in the pass; `way` is about its vertices' `from` and `to`. The solid's own way
/// is set.
[[nodiscard]] bool may_meet(const Box& way, double spacing_m, const Surface& surface, const SolidPlace& solid);
[[nodiscard]] inline bool may_meet(const SurfaceBody& body, const Box& way, const SolidPlace& solid) {
  return may_meet(way, body.spacing_m, body.surface, solid);
}

/// Edges of a skin that may meet a solid, and faces that may meet one of its knobs (shape_parts.h).
struct FeatureList {
  struct FaceAndKnob {
    std::uint32_t face = 0;
    std::uint32_t knob = 0;
  };
  std::vector<std::uint32_t> edges;
  std::vector<FaceAndKnob> faces;

  [[nodiscard]] bool empty() const { return edges.empty() && faces.empty(); }
  [[nodiscard]] std::size_t bytes() const {
    return edges.capacity() * sizeof(std::uint32_t) + faces.capacity() * sizeof(FaceAndKnob);
  }
};

/// Whether edges and faces may meet a solid of that shape deeper than their vertices do: not a plane or a room, and not
/// a mesh, whose surface meets theirs.
[[nodiscard]] bool has_features(const Shape& shape);

/// Finds the rows of soft bodies against solids. A row is of a vertex; of an edge or a face that goes deeper than its
/// vertices do by more than the rows' slack: over the rim of a box, or where the mesh is coarse beside the solid.
class SolidRowFinder {
 public:
  /// Appends the rows of what of the skin (with response `response`) would end nearer to the solid than their
  /// thickness. Sets what the solver is to reach. `reach`: with one above 0, a row is of whatever comes there if it
  /// goes by so many times as much as anything of the skin does, whatever way it would go itself.
  void find(const SkinMove& skin, std::uint32_t response, const SolidPlace& solid, double dt_s, double reach,
            std::vector<ContactRow>& rows);

  /// The furthest that a vertex of the skin looked at last goes, as seen from the solid.
  [[nodiscard]] double furthest_m() const { return furthest_m_; }

  [[nodiscard]] std::size_t bytes() const {
    return sides_.capacity() * sizeof(Sides) + nearest_.capacity() * sizeof(SurfacePoint) + is_known_.capacity() +
           gaps_m_.capacity() * sizeof(double) + aheads_m_.capacity() * sizeof(Vec3d) + candidates_.bytes();
  }

 private:
  static constexpr std::uint8_t no_face = 6;
  struct Sides {
    std::uint8_t past = 0;        // a bit for each of the six walls
    std::uint8_t over = no_face;  // a box's
  };

  void begin(const SkinMove& skin, const SolidPlace& solid, double dt_s);
  void find_aheads();
  [[nodiscard]] const SurfacePoint& nearest(std::uint32_t vertex);
  void list(double move_m, FeatureList& features);
  [[nodiscard]] std::uint8_t face_under(const BoxShape& box, const Vec3d& local, double move_m) const;
  void list_faces(double move_m, FeatureList& features) const;
  void find_walls();
  void find_vertices();
  void find_edges(std::span<const std::uint32_t> edges);
  void find_faces(std::span<const FeatureList::FaceAndKnob> faces);
  void find_face(std::uint32_t face, std::uint32_t knob, const Vec3d& centre, double radius_m);
  [[nodiscard]] Knobs knobs() const;
  [[nodiscard]] bool comes_near(double gap_m, const Vec3d& normal, const Vec3d& ahead_m) const;
  [[nodiscard]] bool is_answered_by_ends(const Support& feature, double gap_m);
  void append_vertex(std::uint32_t vertex, std::uint32_t wall, const Vec3d& normal, double gap_m);
  void append(FeatureKind kind, std::uint64_t feature, const Support& of_skin, const Vec3d& arm, const Vec3d& ahead_m,
              const Vec3d& normal, double gap_m);

  // Of the skin and the solid looked at.
  SkinMove skin_;
  const SolidPlace* solid_ = nullptr;
  double dt_s_ = 0.0;
  std::vector<ContactRow>* rows_ = nullptr;  // where rows go
  std::uint32_t response_ = 0;               // theirs of the skin
  ContactSurface surface_;
  double slack_m_ = 0.0;  // what ends no nearer than this needs no row
  double reach_ = 0.0;
  double reach_m_ = 0.0;               // or is within this
  std::vector<Vec3d> aheads_m_;        // one a vertex
  double furthest_m_ = 0.0;            // of them
  std::vector<double> gaps_m_;         // one a vertex, to a wall
  std::vector<SurfacePoint> nearest_;  // one a vertex, of the solid, in its frame, where it is known
  std::vector<std::uint8_t> is_known_;
  std::vector<Sides> sides_;  // one a vertex
  FeatureList candidates_;
};

/// Sets what the solver is to reach of a row whose gap is set: `ahead_m` is the way of the first as seen from the
/// second that does not lie behind the pass yet, `way_m` that of the whole substep.
void aim_solid_row(ContactRow& row, const Vec3d& ahead_m, const Vec3d& way_m, double dt_s);

/// Cuts the moves of vertices, and of edges' ends, that would end in the solid where it ends.
class SolidCutter {
 public:
  void cut(SurfaceBody& body, const SolidPlace& solid, double dt_s);

  [[nodiscard]] std::size_t bytes() const {
    return (start_m_.capacity() + move_m_.capacity()) * sizeof(Vec3d) + distance_m_.capacity() * sizeof(double);
  }

 private:
  void cut_edges();
  void shorten(std::uint32_t vertex, double share);

  SurfaceBody* body_ = nullptr;
  const Shape* shape_ = nullptr;
  double tolerance_m_ = 0.0;
  double edge_tolerance_m_ = 0.0;
  // One a vertex, in the solid's frame, which moves too.
  std::vector<Vec3d> start_m_, move_m_;
  std::vector<double> distance_m_;  // at the start
};

}  // namespace pneuma::physics
