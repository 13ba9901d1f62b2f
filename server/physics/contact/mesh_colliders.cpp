#include "physics/contact/mesh_colliders.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/contact/groups.h"
#include "physics/contact/surface_rows.h"
#include "physics/rigid/contact_surface.h"
#include "physics/rigid/rigid_motion.h"

namespace pneuma::physics {
namespace {

FaceTree::Box local_box(const Frame& frame, const Box& box, double grown_m) {
  const Vec3d centre = frame.to_local(0.5 * (box.low + box.high));
  const Vec3d half = (frame.rotation.transpose().cwiseAbs() * (0.5 * (box.high - box.low))).array() + grown_m;
  return {centre - half, centre + half};
}

}  // namespace

void find_mesh_colliders(std::span<const ColliderState> colliders, double dt_s, std::vector<MeshCollider>& meshes) {
  meshes.clear();
  for (std::uint32_t i = 0; i < colliders.size(); ++i) {
    const ColliderState& state = colliders[i];
    if (state.tree == nullptr) continue;
    const Collider& c = state.collider;
    const Quatd turned_to = turned(state.orientation, c.angular_velocity, dt_s);
    meshes.push_back({.index = i,
                      .tree = state.tree,
                      .surface = c.surface,
                      .moves = is_moving(c),
                      .start = {state.position, state.orientation},
                      .end = {state.position + dt_s * c.velocity, turned_to}});
  }
}

void load_surface(const MeshCollider& mesh, std::shared_ptr<const SurfaceTopology> topology, SurfaceBody& body) {
  const std::vector<Vec3d>& positions_m = mesh.tree->mesh->positions_m;
  const std::size_t count = positions_m.size();
  if (!body.topology) {
    body.topology = std::move(topology);
    body.surface = mesh.surface;
    body.spacing_m = diagonal_m(positions_m) / std::sqrt(static_cast<double>(count));
    body.shell_m = mesh.surface.thickness_m;
    body.margin_m = (1.0 + row_slack_share) * body.shell_m;
    body.inverse_masses_1_kg.assign(count, 0.0);
    body.cuts.assign(count, 1.0);
    for (auto* points : {&body.from, &body.to}) points->assign(count, Vec3d::Zero());
  } else if (!mesh.moves) {
    return;
  }
  body.at = {};
  for (std::size_t k = 0; k < count; ++k) {
    body.from[k] = mesh.start.to_world(positions_m[k]);
    body.to[k] = mesh.moves ? mesh.end.to_world(positions_m[k]) : body.from[k];
    body.at.include(body.from[k]);
  }
  Box way = body.at;
  if (mesh.moves) way.include(body.box_of_moves());
  const Vec3d margin = Vec3d::Constant(body.margin_m);
  body.way = {way.low - margin, way.high + margin};
}

void MeshCandidateFinder::find(const MeshCollider& mesh, SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  const SurfaceBody& soft = bodies[pair.first];
  const SurfaceBody& surface = bodies[pair.second];
  pair.candidates.clear();
  near_soft_.clear();
  near_mesh_.clear();
  const FaceTree::Box at_start = local_box(mesh.start, soft.way, surface.margin_m);
  const FaceTree::Box at_end = local_box(mesh.end, soft.way, surface.margin_m);
  Box about;
  const std::vector<Face>& mesh_faces = mesh.tree->mesh->faces;
  mesh.tree->faces.for_near({at_start.low_m.cwiseMin(at_end.low_m), at_start.high_m.cwiseMax(at_end.high_m)},
                            [&](std::uint32_t g) {
                              const Box box = way_box(mesh_faces[g], surface.from, surface.to, surface.margin_m);
                              if (!box.overlaps(soft.way)) return;
                              near_mesh_.push_back({g, box});
                              about.include(box);
                            });
  if (near_mesh_.empty()) return;
  const std::vector<Face>& soft_faces = soft.topology->mesh->faces;
  for (std::uint32_t f = 0; f < soft_faces.size(); ++f) {
    const Box box = way_box(soft_faces[f], soft.from, soft.to, soft.margin_m);
    if (box.overlaps(about)) near_soft_.push_back({f, box});
  }
  finder_.find_among(pair, bodies, near_soft_, near_mesh_);
}

void find_ways_out(const MeshCollider& mesh, std::uint32_t first, std::uint32_t second,
                   std::span<const SurfaceBody> bodies, std::vector<ContactRow>& rows) {
  if (!mesh.tree->mesh->closed) return;
  const SurfaceBody& soft = bodies[first];
  const ContactSurface surface = combine(soft.surface, mesh.surface);
  const double kept_m = soft.shell_m + bodies[second].shell_m;
  FaceTree::Box about = mesh.tree->box();
  about.low_m.array() -= (1.0 + row_slack_share) * kept_m;
  about.high_m.array() += (1.0 + row_slack_share) * kept_m;
  for (std::uint32_t i = 0; i < soft.from.size(); ++i) {
    const Vec3d local = mesh.start.to_local(soft.from[i]);
    if (!about.overlaps({local, local})) continue;
    const MeshPoint nearest = mesh.tree->nearest(local);
    const Face& face = mesh.tree->mesh->faces[nearest.face];
    const auto& [a, b, c] = face;
    const std::vector<Vec3d>& at = mesh.tree->mesh->positions_m;
    const Vec3d outward = (at[b] - at[a]).cross(at[c] - at[a]).normalized();
    const double side = sign_of(outward.dot(local - nearest.position_m));
    ContactRow row;
    row.normal = mesh.start.rotation *
                 (nearest.distance_m > 0.0 ? Vec3d(side / nearest.distance_m * (local - nearest.position_m)) : outward);
    row.gap_m = side * nearest.distance_m - kept_m;
    const double slack_m = row_slack_share * kept_m;
    if (row.gap_m > slack_m && row.gap_m + soft.move_m(i).dot(row.normal) > slack_m) continue;
    row.key = feature_key(FeatureKind::way_out, first, second, i);
    row.first.body = first;
    row.first.add(i, 1.0);
    row.second.body = second;
    for (std::size_t k = 0; k < 3; ++k) row.second.add(face[k], nearest.barycentric[static_cast<Eigen::Index>(k)]);
    row.friction = surface.friction;
    row.restitution = 0.0;
    rows.push_back(row);
  }
}

bool is_way_out(const ContactRow& row) {
  return (row.key.bodies & 0xffU) == static_cast<std::uint64_t>(FeatureKind::way_out);
}

void carry_with_meshes(std::span<const SurfacePair> pairs, std::span<const MeshCollider> meshes,
                       std::size_t meshes_begin, std::span<SurfaceBody> bodies, std::vector<std::uint8_t>& carried) {
  carried.assign(bodies.size(), 0);
  if (std::ranges::none_of(meshes, &MeshCollider::moves)) return;
  JoinedBodies joined;
  joined.begin(bodies.size());
  for (const SurfacePair& pair : pairs) joined.join(pair.first, pair.second);
  std::vector<std::uint32_t> meshes_of(bodies.size(), 0);
  for (auto i = static_cast<std::uint32_t>(meshes_begin); i < bodies.size(); ++i) ++meshes_of[joined.lowest_with(i)];
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const auto index = static_cast<std::uint32_t>(meshes_begin + m);
    const std::uint32_t group = joined.lowest_with(index);
    if (!meshes[m].moves || meshes_of[group] != 1) continue;
    for (std::uint32_t i = 0; i < meshes_begin; ++i) {
      if (joined.lowest_with(i) != group) continue;
      for (std::size_t k = 0; k < bodies[i].from.size(); ++k) {
        if (bodies[i].inverse_masses_1_kg[k] > 0.0) bodies[i].from[k] = meshes[m].carried(bodies[i].from[k]);
      }
      carried[i] = 1;
    }
    bodies[index].from = bodies[index].to;
  }
}

}  // namespace pneuma::physics
