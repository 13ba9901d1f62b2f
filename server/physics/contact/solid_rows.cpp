#include "physics/contact/solid_rows.h"

#include <algorithm>
#include <cmath>

#include "physics/contact/factored_response.h"
#include "physics/rigid/contact_surface.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/scene/shape_parts.h"

namespace pneuma::physics {
namespace {

// Of the mean distance of a body's vertices: what ends no nearer than this needs no row.
constexpr double solid_slack_share = 0.02;
// Of the spacing: what ends no deeper than this is on the surface, as the solver's tolerance leaves it.
constexpr double in_solid_share = 1e-6;
// A box that is moved outwards keeps its corners sharp: they go by this much of it, the root of 3 or a little more.
constexpr double sharp_corner_reach = 1.733;
// A vertex that is deeper than its surface goes back out within this time.
constexpr double solid_overlap_time_s = 0.1;

enum class SolidRowKind : std::uint64_t { vertex = 4, corner = 5, axis = 6 };

FeatureKey solid_key_of(SolidRowKind kind, std::uint32_t response, std::uint32_t solid, std::uint64_t feature) {
  return {(static_cast<std::uint64_t>(response) << 32U) | (static_cast<std::uint64_t>(solid) << 8U) |
              static_cast<std::uint64_t>(kind),
          feature};
}

// Where a point stands towards one wall of a solid, in the world.
struct RowWall {
  Vec3d normal = Vec3d::UnitY();
  double gap_m = 0.0;
  std::uint32_t index = 0;
};

Frame moved(const SolidPlace& solid, double dt_s) {
  const Quatd orientation = turned(Quatd(solid.at.rotation), solid.ahead_turning, dt_s);
  return {solid.at.origin + dt_s * solid.ahead, orientation};
}

// Calls visit(wall) for the walls of the solid that the point may meet on its way.
template <class Visit>
void for_walls(const SolidPlace& solid, const Frame& end, const Vec3d& from, const Vec3d& to, double offset_m,
               double reach_m, const Visit& visit) {
  if (const auto* plane = std::get_if<PlaneShape>(solid.shape)) {
    const Vec3d normal = solid.at.rotation * plane->normal;
    visit(RowWall{normal, normal.dot(from - solid.at.origin) - offset_m, 0});
    return;
  }
  const Vec3d local = solid.at.to_local(from);
  if (const auto* room = std::get_if<RoomShape>(solid.shape)) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double side = sign_of(local[axis]);
      const double gap_m = room->half_extents_m[axis] - offset_m - std::abs(local[axis]);
      const Vec3d normal = -side * solid.at.rotation.col(axis);
      visit(RowWall{normal, gap_m, static_cast<std::uint32_t>(2 * axis + (side > 0.0 ? 1 : 0))});
    }
    return;
  }
  const SurfacePoint nearest = nearest_surface(*solid.shape, local, offset_m);
  if (nearest.distance_m > reach_m) {
    const auto hit = first_hit(*solid.shape, local, end.to_local(to), offset_m, 0.0);
    if (!hit) return;
    visit(RowWall{solid.at.rotation * hit->normal, (local - hit->point).dot(hit->normal), 0});
    return;
  }
  visit(RowWall{solid.at.rotation * nearest.normal, nearest.distance_m, 0});
}

}  // namespace

void set_way(SolidPlace& solid, double dt_s) {
  if (is_surface(*solid.shape)) return;  // its way stays empty: surfaces meet it (mesh_colliders.h)
  const Vec3d reach =
      Vec3d::Constant(half_extents_m(*solid.shape).norm() + sharp_corner_reach * solid.surface->thickness_m);
  const Vec3d end = solid.at.origin + dt_s * solid.ahead;
  solid.way = {solid.at.origin.cwiseMin(end) - reach, solid.at.origin.cwiseMax(end) + reach};
}

bool may_meet(const SurfaceBody& body, const Box& way, const SolidPlace& solid) {
  const Vec3d reach =
      Vec3d::Constant(sharp_corner_reach * (body.surface.thickness_m + solid_slack_share * body.spacing_m));
  return solid.way.overlaps({way.low - reach, way.high + reach});
}

// `gap_m` is where the pass found the two; what it found in each other parts slowly.
void aim_solid_row(ContactRow& row, const Vec3d& ahead_m, const Vec3d& way_m, double dt_s) {
  const Vec3d across = way_m - way_m.dot(row.normal) * row.normal;
  row.free_m_s = (ahead_m.dot(row.normal) * row.normal + across) / dt_s;
  row.least_m_s = (row.gap_m > 0.0 ? -row.gap_m : -row.gap_m * std::min(1.0, dt_s / solid_overlap_time_s)) / dt_s;
}

void find_solid_rows(const SurfaceBody& body, std::uint32_t response, std::span<const Vec3d> start,
                     const SolidPlace& solid, double dt_s, std::vector<ContactRow>& rows) {
  if (is_surface(*solid.shape)) return;  // its surface meets the body's (mesh_colliders.h)
  const ContactSurface surface = combine(body.surface, *solid.surface);
  const double slack_m = solid_slack_share * body.spacing_m;
  const Frame end = moved(solid, dt_s);
  for (std::uint32_t i = 0; i < body.from.size(); ++i) {
    if (body.inverse_masses_1_kg[i] == 0.0) continue;
    const Vec3d arm = body.from[i] - solid.at.origin;
    const Vec3d ahead_m = body.move_m(i) - dt_s * velocity_at(solid.ahead, solid.ahead_turning, arm);
    const double reach_m = slack_m + ahead_m.norm();
    for_walls(solid, end, body.from[i], body.to[i], surface.thickness_m, reach_m, [&](const RowWall& wall) {
      if (wall.gap_m > slack_m && wall.gap_m + ahead_m.dot(wall.normal) > slack_m) return;
      ContactRow row;
      row.key = solid_key_of(SolidRowKind::vertex, response, solid.response,
                             (static_cast<std::uint64_t>(i) << 8U) | wall.index);
      row.first.body = response;
      row.first.add(i, 1.0);
      row.second.body = solid.response;
      row.second.arm = arm;
      row.normal = wall.normal;
      row.gap_m = wall.gap_m;
      row.friction = surface.friction;
      row.restitution = surface.restitution;
      const Vec3d way_m = body.to[i] - start[i] - dt_s * velocity_at(solid.velocity, solid.angular_velocity, arm);
      aim_solid_row(row, ahead_m, way_m, dt_s);
      rows.push_back(row);
    });
  }
}

void find_corner_rows(const SurfaceBody& body, std::uint32_t response, std::span<const Vec3d> start,
                      const SolidPlace& solid, double dt_s, std::vector<ContactRow>& rows) {
  Knobs knobs =
      of_rigid_shape(*solid.shape, Knobs(), [](const auto& rigid, const auto& one) { return rigid.knobs(one); });
  for (std::size_t k = 0; k < knobs.count; ++k) knobs.centres[k] = solid.at.to_world(knobs.centres[k]);
  const ContactSurface surface = combine(body.surface, *solid.surface);
  const Mesh& mesh = *body.topology->mesh;
  const double slack_m = solid_slack_share * body.spacing_m;
  const double kept_m = knobs.radius_m + surface.thickness_m;
  for (std::size_t k = 0; k < knobs.count; ++k) {
    const Vec3d arm = knobs.centres[k] - solid.at.origin;
    const Vec3d corner_m = dt_s * velocity_at(solid.ahead, solid.ahead_turning, arm);
    const Vec3d corner_way_m = dt_s * velocity_at(solid.velocity, solid.angular_velocity, arm);
    for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
      const auto& [a, b, c] = mesh.faces[f];
      const double near_m = kept_m + 2.0 * body.spacing_m;
      if ((body.from[a] - knobs.centres[k]).squaredNorm() > near_m * near_m * 4.0) continue;
      const FacePoint nearest = nearest_of_face(knobs.centres[k], body.from[a], body.from[b], body.from[c]);
      if (nearest.corners() != 7) continue;
      const auto& w = nearest.weights;
      const auto mean = [&](const auto& of) -> Vec3d { return w[0] * of(a) + w[1] * of(b) + w[2] * of(c); };
      const Vec3d point = mean([&](std::uint32_t v) -> Vec3d { return body.from[v]; });
      const Vec3d apart = point - knobs.centres[k];
      if (!(nearest.distance_m > 0.0)) continue;
      ContactRow row;
      row.normal = apart / nearest.distance_m;
      row.gap_m = nearest.distance_m - kept_m;
      const Vec3d ahead_m = mean([&](std::uint32_t v) -> Vec3d { return body.move_m(v); }) - corner_m;
      if (row.gap_m > slack_m && row.gap_m + ahead_m.dot(row.normal) > slack_m) continue;
      row.key = solid_key_of(SolidRowKind::corner, response, solid.response, (static_cast<std::uint64_t>(f) << 8U) | k);
      row.first.body = response;
      row.first.add(a, w[0]);
      row.first.add(b, w[1]);
      row.first.add(c, w[2]);
      row.second.body = solid.response;
      row.second.arm = arm + knobs.radius_m * row.normal;
      row.friction = surface.friction;
      row.restitution = surface.restitution;
      const Vec3d way_m = mean([&](std::uint32_t v) -> Vec3d { return body.to[v] - start[v]; }) - corner_way_m;
      aim_solid_row(row, ahead_m, way_m, dt_s);
      rows.push_back(row);
    }
  }
  if (!knobs.is_rod) return;
  // Its axis and the edges.
  for (std::uint32_t e = 0; e < mesh.edges.size(); ++e) {
    const auto& [a, b] = mesh.edges[e];
    const EdgePoints nearest = nearest_of_edges(body.from[a], body.from[b], knobs.centres[0], knobs.centres[1]);
    if (!nearest.within_both || !(nearest.distance_m > 0.0)) continue;
    const double share = nearest.along_first;
    const auto mean = [&](const auto& of) -> Vec3d { return (1.0 - share) * of(a) + share * of(b); };
    const Vec3d on_axis = knobs.centres[0] + nearest.along_second * (knobs.centres[1] - knobs.centres[0]);
    const Vec3d arm = on_axis - solid.at.origin;
    ContactRow row;
    row.normal = (mean([&](std::uint32_t v) -> Vec3d { return body.from[v]; }) - on_axis) / nearest.distance_m;
    row.gap_m = nearest.distance_m - kept_m;
    const Vec3d ahead_m = mean([&](std::uint32_t v) -> Vec3d { return body.move_m(v); }) -
                          dt_s * velocity_at(solid.ahead, solid.ahead_turning, arm);
    if (row.gap_m > slack_m && row.gap_m + ahead_m.dot(row.normal) > slack_m) continue;
    row.key = solid_key_of(SolidRowKind::axis, response, solid.response, e);
    row.first.body = response;
    row.first.add(a, 1.0 - share);
    row.first.add(b, share);
    row.second.body = solid.response;
    row.second.arm = arm + knobs.radius_m * row.normal;
    row.friction = surface.friction;
    row.restitution = surface.restitution;
    const Vec3d way_m = mean([&](std::uint32_t v) -> Vec3d { return body.to[v] - start[v]; }) -
                        dt_s * velocity_at(solid.velocity, solid.angular_velocity, arm);
    aim_solid_row(row, ahead_m, way_m, dt_s);
    rows.push_back(row);
  }
}

void cut_at_solid(SurfaceBody& body, const SolidPlace& solid, double dt_s) {
  if (is_surface(*solid.shape)) return;
  const Frame end = moved(solid, dt_s);
  for (std::size_t i = 0; i < body.from.size(); ++i) {
    if (body.inverse_masses_1_kg[i] == 0.0) continue;
    const Vec3d from = solid.at.to_local(body.from[i]);
    if (surface_distance(*solid.shape, from) <= 0.0) continue;  // on its way out, or the surface has come to it
    const Vec3d to = end.to_local(body.from[i] + body.cuts[i] * body.move_m(static_cast<std::uint32_t>(i)));
    const double tolerance_m = in_solid_share * body.spacing_m;
    if (surface_distance(*solid.shape, to) >= -tolerance_m) continue;
    if (const auto hit = first_hit(*solid.shape, from, to, 0.0, 0.0)) body.cuts[i] *= hit->fraction;
  }
}

}  // namespace pneuma::physics
