#include "physics/contact/solid_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/contact/solid_features.h"
#include "physics/rigid/contact_surface.h"
#include "physics/rigid/rigid_mesh.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/scene/shape_parts.h"

namespace pneuma::physics {
namespace {

// Of the spacing: what ends no deeper than this is on the surface, as the solver's tolerance leaves it.
constexpr double in_solid_share = 1e-6;
// An edge may lie as deep as rows may leave it. Cut sooner, it would be
// held by its place alone at each step over a rim, and the springs fed: a ball on the rim of a block spun up for ever.
constexpr double edge_in_solid_share = 0.1;
// A box that is moved outwards keeps its corners sharp: they go by this much of it, the root of 3 or a little more.
constexpr double sharp_corner_reach = 1.733;
// Of the distance to a corner: where the solid is nearer than this, the corner is not what is nearest.
constexpr double corner_share = 0.99;
// Of a solid in a pass.
constexpr double swept_turn_max_rad = 0.2;
// Of a move, until its edge ends at the solid.
constexpr int cut_halvings = 20;
// A vertex that is deeper than its surface goes back out within this time. Its velocity out is energy, so it is slow.
constexpr double solid_overlap_time_s = 0.3;

// A wall of a solid, in the world.
struct RowWall {
  Vec3d normal = Vec3d::UnitY();  // away from it
  double level_m = 0.0;           // what is there along the normal
  std::uint32_t index = 0;
};

Frame moved(const SolidPlace& solid, double dt_s) {
  const Quatd orientation = turned(Quatd(solid.at.rotation), solid.ahead_turning, dt_s);
  return {solid.at.origin + dt_s * solid.ahead, orientation};
}

// Calls visit(wall) for the walls of a plane or a room, moved by the thickness.
template <class Visit>
void for_walls(const SolidPlace& solid, double offset_m, const Visit& visit) {
  if (const auto* plane = std::get_if<PlaneShape>(solid.shape)) {
    const Vec3d normal = solid.at.rotation * plane->normal;
    visit(RowWall{normal, normal.dot(solid.at.origin) + offset_m, 0});
    return;
  }
  const auto& room = std::get<RoomShape>(*solid.shape);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const Vec3d normal = -side * solid.at.rotation.col(axis);
      const double level_m = normal.dot(solid.at.origin) - room.half_extents_m[axis] + offset_m;
      visit(RowWall{normal, level_m, static_cast<std::uint32_t>(2 * axis + (side > 0.0 ? 1 : 0))});
    }
  }
}

bool has_flat_walls(const Shape& shape) {
  return std::holds_alternative<PlaneShape>(shape) || std::holds_alternative<RoomShape>(shape);
}

}  // namespace

void set_way(SolidPlace& solid, double dt_s) {
  if (is_surface(*solid.shape)) return;  // its way stays empty: surfaces meet it (mesh_colliders.h)
  const Vec3d reach =
      Vec3d::Constant(half_extents_m(*solid.shape).norm() + sharp_corner_reach * solid.surface->thickness_m);
  const Vec3d end = solid.at.origin + dt_s * solid.ahead;
  solid.way = {solid.at.origin.cwiseMin(end) - reach, solid.at.origin.cwiseMax(end) + reach};
}

bool may_meet(const Box& way, double spacing_m, const Surface& surface, const SolidPlace& solid) {
  const Vec3d reach = Vec3d::Constant(sharp_corner_reach * (surface.thickness_m + solid_slack_share * spacing_m));
  return solid.way.overlaps({way.low - reach, way.high + reach});
}

// `gap_m` is where the pass found the two; what it found in each other parts slowly.
void aim_solid_row(ContactRow& row, const Vec3d& ahead_m, const Vec3d& way_m, double dt_s) {
  const Vec3d across = way_m - way_m.dot(row.normal) * row.normal;
  row.free_m_s = (ahead_m.dot(row.normal) * row.normal + across) / dt_s;
  row.least_m_s = (row.gap_m > 0.0 ? -row.gap_m : -row.gap_m * std::min(1.0, dt_s / solid_overlap_time_s)) / dt_s;
}

bool has_features(const Shape& shape) {
  return !is_surface(shape) && !has_flat_walls(shape);
}

void SolidRowFinder::find(const SkinMove& skin, std::uint32_t response, const SolidPlace& solid, double dt_s,
                          double reach, std::vector<ContactRow>& rows) {
  if (is_surface(*solid.shape)) return;  // its surface meets the body's (mesh_colliders.h)
  begin(skin, solid, dt_s);
  rows_ = &rows;
  response_ = response;
  reach_ = reach;
  reach_m_ = 0.0;
  if (has_flat_walls(*solid.shape)) {
    find_walls();  // an edge or a face goes no deeper than its ends do
    return;
  }
  reach_m_ = reach * furthest_m_;
  list(std::max(1.0, reach) * furthest_m_, candidates_);
  find_vertices();
  find_edges(candidates_.edges);
  find_faces(candidates_.faces);
}

void SolidRowFinder::begin(const SkinMove& skin, const SolidPlace& solid, double dt_s) {
  skin_ = skin;
  solid_ = &solid;
  dt_s_ = dt_s;
  surface_ = combine(*skin.surface, *solid.surface);
  slack_m_ = solid_slack_share * skin.spacing_m;
  nearest_.resize(skin.from.size());
  is_known_.assign(skin.from.size(), 0);
  find_aheads();
}

// Of all vertices, their ways as seen from the solid.
void SolidRowFinder::find_aheads() {
  const std::size_t count = skin_.from.size();
  const Vec3d shift_m = dt_s_ * solid_->ahead;
  const bool turns = !solid_->ahead_turning.isZero(0.0);
  aheads_m_.resize(count);
  double furthest_m2 = 0.0;
  for (std::uint32_t i = 0; i < count; ++i) {
    aheads_m_[i] = skin_.move_m(i) - shift_m;
    if (turns) aheads_m_[i] -= dt_s_ * solid_->ahead_turning.cross(skin_.from[i] - solid_->at.origin);
    furthest_m2 = std::max(furthest_m2, aheads_m_[i].squaredNorm());
  }
  furthest_m_ = std::sqrt(furthest_m2);
}

const SurfacePoint& SolidRowFinder::nearest(std::uint32_t vertex) {
  if (is_known_[vertex] == 0) {
    nearest_[vertex] = nearest_surface(*solid_->shape, solid_->at.to_local(skin_.from[vertex]), surface_.thickness_m);
    is_known_[vertex] = 1;
  }
  return nearest_[vertex];
}

// By the walls of a box about all that may be met: features whose vertices are all past one of them stay out of it. An
// edge whose ends stay over one face of a box goes no deeper than they do.
void SolidRowFinder::list(double move_m, FeatureList& features) {
  const double reach_m = surface_.thickness_m + sharp_corner_reach * (slack_m_ + move_m);
  const Vec3d outer = half_extents_m(*solid_->shape).array() + reach_m;
  const auto* box = std::get_if<BoxShape>(solid_->shape);
  const std::size_t count = skin_.from.size();
  sides_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3d local = solid_->at.to_local(skin_.from[i]);
    unsigned past = 0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      past |= local[axis] > outer[axis] ? 1U << (2 * axis) : local[axis] < -outer[axis] ? 2U << (2 * axis) : 0U;
    }
    sides_[i].past = static_cast<std::uint8_t>(past);
    sides_[i].over = box == nullptr ? no_face : face_under(*box, local, move_m);
  }
  features.edges.clear();
  const std::vector<Edge>& edges = skin_.mesh->edges;
  for (std::uint32_t e = 0; e < edges.size(); ++e) {
    const Sides& a = sides_[edges[e][0]];
    const Sides& b = sides_[edges[e][1]];
    if ((a.past & b.past) == 0 && (a.over != b.over || a.over == no_face)) features.edges.push_back(e);
  }
  list_faces(move_m, features);
}

// The face that stays the nearest of the box to a point that moves by so much: outside or not deep, and further from
// the other faces.
std::uint8_t SolidRowFinder::face_under(const BoxShape& box, const Vec3d& local, double move_m) const {
  const Vec3d half = box.half_extents_m.array() + surface_.thickness_m;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (std::abs(local[axis]) <= half[axis] - move_m) continue;
    bool is_within = true;
    for (Eigen::Index other = 0; other < 3; ++other) {
      is_within = is_within && (other == axis || std::abs(local[other]) < half[other] - 4.0 * move_m);
    }
    if (is_within) return static_cast<std::uint8_t>(2 * axis + (local[axis] > 0.0 ? 1 : 0));
  }
  return no_face;
}

Knobs SolidRowFinder::knobs() const {
  Knobs knobs =
      of_rigid_shape(*solid_->shape, Knobs(), [](const auto& rigid, const auto& one) { return rigid.knobs(one); });
  for (std::size_t k = 0; k < knobs.count; ++k) knobs.centres[k] = solid_->at.to_world(knobs.centres[k]);
  return knobs;
}

void SolidRowFinder::list_faces(double move_m, FeatureList& features) const {
  features.faces.clear();
  const Knobs knobs = this->knobs();
  const double kept_m = knobs.radius_m + surface_.thickness_m;
  // A face's corners may each come that near, and its edges grow.
  const double near_m = std::max(kept_m + slack_m_, skin_.spacing_m) + 3.0 * move_m;
  const std::vector<Face>& faces = skin_.mesh->faces;
  const std::span<const Vec3d> from = skin_.from;
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    const auto& [a, b, c] = faces[f];
    if ((sides_[a].past & sides_[b].past & sides_[c].past) != 0) continue;
    const double reach_m =
        near_m + std::sqrt(std::max((from[b] - from[a]).squaredNorm(), (from[c] - from[a]).squaredNorm()));
    for (std::uint32_t k = 0; k < knobs.count; ++k) {
      if ((from[a] - knobs.centres[k]).squaredNorm() <= reach_m * reach_m) features.faces.push_back({f, k});
    }
  }
}

void SolidRowFinder::find_walls() {
  const std::size_t count = skin_.from.size();
  gaps_m_.resize(count);
  Box at;
  for (const Vec3d& from : skin_.from) at.include(from);
  const Vec3d middle = 0.5 * (at.low + at.high);
  const Vec3d half = 0.5 * (at.high - at.low);
  const double any_way_m = std::max(1.0, reach_) * furthest_m_;
  for_walls(*solid_, surface_.thickness_m, [&](const RowWall& wall) {
    const double nearest_m = wall.normal.dot(middle) - wall.normal.cwiseAbs().dot(half) - wall.level_m;
    if (nearest_m - any_way_m > slack_m_) return;
    double least_m = std::numeric_limits<double>::infinity();
    double inward_m = 0.0;
    for (std::uint32_t i = 0; i < count; ++i) {
      gaps_m_[i] = wall.normal.dot(skin_.from[i]) - wall.level_m;
      least_m = std::min(least_m, gaps_m_[i]);
      inward_m = std::max(inward_m, -wall.normal.dot(aheads_m_[i]));
    }
    reach_m_ = reach_ * inward_m;
    if (least_m - std::max(reach_m_, inward_m) > slack_m_) return;
    for (std::uint32_t i = 0; i < count; ++i) append_vertex(i, wall.index, wall.normal, gaps_m_[i]);
  });
}

void SolidRowFinder::find_vertices() {
  const Frame end = moved(*solid_, dt_s_);
  for (std::uint32_t i = 0; i < skin_.from.size(); ++i) {
    if (sides_[i].past != 0) continue;
    const SurfacePoint& at = nearest(i);
    if (at.distance_m <= slack_m_ + std::max(reach_m_, aheads_m_[i].norm())) {
      append_vertex(i, 0, solid_->at.rotation * at.normal, at.distance_m);
      continue;
    }
    const Vec3d local = solid_->at.to_local(skin_.from[i]);
    const auto hit = first_hit(*solid_->shape, local, end.to_local(skin_.to[i]), surface_.thickness_m, 0.0);
    if (hit) append_vertex(i, 0, solid_->at.rotation * hit->normal, (local - hit->point).dot(hit->normal));
  }
}

void SolidRowFinder::append_vertex(std::uint32_t vertex, std::uint32_t wall, const Vec3d& normal, double gap_m) {
  if (gap_m > slack_m_ + reach_m_ && reach_ > 1.0) return;  // no vertex comes as far
  const Vec3d way_m = aheads_m_[vertex];
  if (skin_.inverse_masses_1_kg[vertex] == 0.0 && !solid_->yields) return;
  if (!comes_near(gap_m, normal, way_m)) return;
  Support support;
  support.add(vertex, 1.0);
  append(FeatureKind::solid_vertex, (static_cast<std::uint64_t>(vertex) << 8U) | wall, support,
         skin_.from[vertex] - solid_->at.origin, way_m, normal, gap_m);
}

void SolidRowFinder::find_edges(std::span<const std::uint32_t> edges) {
  for (const std::uint32_t e : edges) {
    const auto& [a, b] = skin_.mesh->edges[e];
    const Vec3d first = solid_->at.to_local(skin_.from[a]);
    const Vec3d second = solid_->at.to_local(skin_.from[b]);
    const double near_m = slack_m_ + std::max({reach_m_, aheads_m_[a].norm(), aheads_m_[b].norm()});
    const auto touch = touch_of_edge(*solid_->shape, surface_.thickness_m, first, nearest(a), second, nearest(b),
                                     edge_slack_share * skin_.spacing_m, near_m);
    if (!touch) continue;
    Support edge;
    edge.add(a, 1.0 - touch->share);
    edge.add(b, touch->share);
    const Vec3d edge_ahead_m = (1.0 - touch->share) * aheads_m_[a] + touch->share * aheads_m_[b];
    const double gap_m = touch->of_solid.distance_m;
    const Vec3d normal = solid_->at.rotation * touch->of_solid.normal;
    if (!comes_near(gap_m, normal, edge_ahead_m)) continue;
    const Vec3d arm = solid_->at.rotation * (first + touch->share * (second - first));
    append(FeatureKind::solid_edge, e, edge, arm, edge_ahead_m, normal, gap_m);
  }
}

// What of a solid may meet a face inside its border: the corners of a box or a convex mesh, the centre of a ball, the
// ends of a capsule.
void SolidRowFinder::find_faces(std::span<const FeatureList::FaceAndKnob> faces) {
  if (faces.empty()) return;
  const Knobs knobs = this->knobs();
  for (const auto& [face, knob] : faces) find_face(face, knob, knobs.centres[knob], knobs.radius_m);
}

void SolidRowFinder::find_face(std::uint32_t face, std::uint32_t knob, const Vec3d& centre, double radius_m) {
  const auto& [a, b, c] = skin_.mesh->faces[face];
  const FacePoint foot = nearest_of_face(centre, skin_.from[a], skin_.from[b], skin_.from[c]);
  if (foot.corners() != 7 || !(foot.distance_m > 0.0)) return;
  Support support;
  support.add(a, foot.weights[0]);
  support.add(b, foot.weights[1]);
  support.add(c, foot.weights[2]);
  const Vec3d point = mean_of(support, skin_.from);
  const Vec3d arm = centre - solid_->at.origin;
  // A face touches a corner from outside, along one of the ways that have the corner as the nearest of the solid; one
  // that the corner has gone through lies along the opposite of such a way.
  const Vec3d opposite = solid_->at.to_local(2.0 * centre - point);
  const bool is_through =
      radius_m == 0.0 && surface_distance(*solid_->shape, opposite) >= corner_share * foot.distance_m;
  const double side = is_through ? -1.0 : 1.0;
  const Vec3d normal = side / foot.distance_m * (point - centre);
  if (is_through && foot.distance_m > through_share * skin_.spacing_m) return;
  if (is_through && normal.dot(point - solid_->at.origin) <= 0.0) return;  // past the middle: another corner's
  const double gap_m = side * foot.distance_m - radius_m - surface_.thickness_m;
  if (is_answered_by_ends(support, gap_m)) return;
  const Vec3d knob_m = dt_s_ * velocity_at(solid_->ahead, solid_->ahead_turning, arm);
  const Vec3d face_ahead_m = mean_of(support, skin_.to) - point - knob_m;
  if (!comes_near(gap_m, normal, face_ahead_m)) return;
  append(FeatureKind::solid_corner, (static_cast<std::uint64_t>(face) << 8U) | knob, support, arm + radius_m * normal,
         face_ahead_m, normal, gap_m);
}

bool SolidRowFinder::comes_near(double gap_m, const Vec3d& normal, const Vec3d& ahead_m) const {
  return gap_m <= slack_m_ + reach_m_ || gap_m + ahead_m.dot(normal) <= slack_m_;
}

// Where it goes little deeper than its vertices.
bool SolidRowFinder::is_answered_by_ends(const Support& feature, double gap_m) {
  double ends_m = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < feature.count; ++i) ends_m = std::min(ends_m, nearest(feature.vertices[i]).distance_m);
  return ends_m - gap_m <= slack_m_;
}

void SolidRowFinder::append(FeatureKind kind, std::uint64_t feature, const Support& of_skin, const Vec3d& arm,
                            const Vec3d& ahead_m, const Vec3d& normal, double gap_m) {
  ContactRow& row = rows_->emplace_back();
  row.key = feature_key(kind, response_, solid_->response, feature);
  row.first = of_skin;
  row.first.body = response_;
  row.second.body = solid_->response;
  row.second.arm = arm;
  row.normal = normal;
  row.gap_m = gap_m;
  row.friction = surface_.friction;
  row.restitution = surface_.restitution;
  const Vec3d way_m = mean_of(of_skin, skin_.to) - mean_of(of_skin, skin_.start) -
                      dt_s_ * velocity_at(solid_->velocity, solid_->angular_velocity, arm);
  aim_solid_row(row, ahead_m, way_m, dt_s_);
}

void SolidCutter::cut(SurfaceBody& body, const SolidPlace& solid, double dt_s) {
  if (is_surface(*solid.shape)) return;
  body_ = &body;
  shape_ = solid.shape;
  tolerance_m_ = in_solid_share * body.spacing_m;
  edge_tolerance_m_ = edge_in_solid_share * body.spacing_m;
  const Frame end = moved(solid, dt_s);
  // Who ends outside of walls was not inside. In a frame that turns far, ways are not straight.
  const bool is_flat = has_flat_walls(*shape_);
  const bool is_swept = !is_flat && dt_s * solid.ahead_turning.norm() < swept_turn_max_rad;
  const std::size_t count = body.from.size();
  start_m_.resize(count);
  move_m_.resize(count);
  distance_m_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    start_m_[i] = solid.at.to_local(body.from[i]);
    distance_m_[i] = surface_distance(*shape_, start_m_[i]);
    const Vec3d end_m = end.to_local(body.from[i] + body.cuts[i] * body.move_m(i));
    move_m_[i] = end_m - start_m_[i];
    if (body.inverse_masses_1_kg[i] == 0.0) continue;
    if (distance_m_[i] < -tolerance_m_) continue;  // on its way out, or the surface has come to it
    const double end_distance_m = surface_distance(*shape_, end_m);
    // It ends outside, and its way is too short to have been in between.
    const double apart_m = distance_m_[i] + end_distance_m;
    if (end_distance_m >= -tolerance_m_ && (!is_swept || apart_m * apart_m > move_m_[i].squaredNorm())) continue;
    if (const auto hit = first_hit(*shape_, start_m_[i], end_m, 0.0, tolerance_m_)) shorten(i, hit->fraction);
  }
  if (!is_flat) cut_edges();
}

void SolidCutter::cut_edges() {
  for (const auto& [a, b] : body_->topology->mesh->edges) {
    if (distance_m_[a] < -tolerance_m_ || distance_m_[b] < -tolerance_m_) continue;
    const double reach_m = 2.0 * std::max(move_m_[a].norm(), move_m_[b].norm());
    const double ends_m = distance_m_[a] + distance_m_[b] - reach_m;
    if (ends_m > 0.0 && ends_m * ends_m > (start_m_[b] - start_m_[a]).squaredNorm()) continue;
    const auto is_in = [&](double share) {
      const Vec3d first = start_m_[a] + share * move_m_[a];
      const Vec3d way = start_m_[b] + share * move_m_[b] - first;
      return surface_distance(*shape_, first + deepest_on_segment(*shape_, first, way, deepest_halvings) * way) <
             -edge_tolerance_m_;
    };
    if (!is_in(1.0) || is_in(0.0)) continue;
    double clear = 0.0;
    double crossed = 1.0;
    for (int i = 0; i < cut_halvings; ++i) {
      const double middle = 0.5 * (clear + crossed);
      (is_in(middle) ? crossed : clear) = middle;
    }
    shorten(a, clear);
    shorten(b, clear);
  }
}

void SolidCutter::shorten(std::uint32_t vertex, double share) {
  body_->cuts[vertex] *= share;
  move_m_[vertex] *= share;
}

}  // namespace pneuma::physics
