#include "physics/queries.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/nearest_word.h"
#include "physics/scene/shape_parts.h"

namespace pneuma::physics {

namespace {

// A tree takes as long to make as some four looks at every face.
constexpr std::size_t questions_worth_a_tree = 4;

std::vector<Vec3d> positions_of(const World& world, std::uint32_t soft) {
  std::vector<Vec3d> positions_m(world.soft_body(soft).mesh->positions_m.size());
  world.copy_positions(soft, std::span(positions_m.front().data(), 3 * positions_m.size()));
  return positions_m;
}

FaceTree::Box grown(const Frame& frame, const Vec3d& half_m) {
  const Vec3d across_m = frame.rotation.cwiseAbs() * half_m;
  return {frame.origin - across_m, frame.origin + across_m};
}

// Infinite half extents make no number of an axis that is not turned.
FaceTree::Box box_of_shape(const Frame& frame, const Vec3d& half_m) {
  if (half_m.allFinite()) return grown(frame, half_m);
  const Vec3d endless = Vec3d::Constant(std::numeric_limits<double>::infinity());
  return {-endless, endless};
}

double inside_or_out(const FacesAt& surface, const MeshPoint& nearest, const Vec3d& point, bool is_closed) {
  const bool is_inside = is_closed && unit_normal(surface, nearest.face).dot(point - nearest.position_m) < 0.0;
  return is_inside ? -nearest.distance_m : nearest.distance_m;
}

}  // namespace

std::optional<BodyRef> find_body(const World& world, const std::string& name) {
  const auto bodies = all_bodies(world);
  const auto found = std::ranges::find_if(bodies, [&](BodyRef body) { return name_of(world, body) == name; });
  return found == bodies.end() ? std::nullopt : std::optional(*found);
}

base::Status no_such_body(const World& world, const std::string& name, const std::string& field) {
  std::vector<std::string> names;
  for (const BodyRef body : all_bodies(world)) names.push_back(name_of(world, body));
  return base::not_found("no such body \"" + name + "\"" + base::nearest_or_all(name, names), field);
}

const std::string& name_of(const World& world, BodyRef body) {
  switch (body.kind) {
    case BodyKind::soft:
      return world.soft_body(body.index).name;
    case BodyKind::rigid:
      return world.rigid_bodies()[body.index].body.name;
    case BodyKind::collider:
      break;
  }
  return world.colliders()[body.index].collider.name;
}

std::vector<BodyRef> all_bodies(const World& world) {
  std::vector<BodyRef> bodies;
  const auto add = [&](BodyKind kind, std::size_t count) {
    for (std::uint32_t i = 0; i < count; ++i) bodies.push_back({kind, i});
  };
  add(BodyKind::soft, world.soft_body_count());
  add(BodyKind::rigid, world.rigid_bodies().size());
  add(BodyKind::collider, world.colliders().size());
  return bodies;
}

FaceTree::Box box_about(const World& world, BodyRef body) {
  if (body.kind == BodyKind::soft) return box_about(positions_of(world, body.index));
  const RigidState& state = world.rigid_bodies()[body.index];
  const Frame frame(state.position, state.orientation);
  const Vec3d half_m =
      of_rigid_shape(state.body.shape, Vec3d(Vec3d::Zero()),
                     [&](const auto& rigid, const auto& shape) { return rigid.half_box_m(shape, frame.rotation); });
  return {state.position - half_m, state.position + half_m};
}

SurfaceQueries::SurfaceQueries(const World& world, const std::vector<BodyRef>& among) {
  candidates_.reserve(among.size());
  for (const BodyRef body : among) {
    Candidate& candidate = candidates_.emplace_back();
    candidate.body = body;
    if (body.kind == BodyKind::soft) {
      candidate.skin.positions_m = positions_of(world, body.index);
      candidate.skin.mesh = world.soft_body(body.index).mesh;
      candidate.box = box_about(candidate.skin.positions_m);
    } else if (body.kind == BodyKind::rigid) {
      const RigidState& state = world.rigid_bodies()[body.index];
      candidate.set_solid(Frame(state.position, state.orientation), state.body.shape, nullptr);
    } else {
      const ColliderState& state = world.colliders()[body.index];
      candidate.set_solid(Frame(state.position, state.orientation), state.collider.shape, state.tree.get());
    }
  }
}

void SurfaceQueries::Candidate::set_solid(const Frame& at, const Shape& of_shape, const MeshTree* of_mesh) {
  frame = at;
  shape = &of_shape;
  mesh = of_mesh;
  box = box_of_shape(at, half_extents_m(of_shape));
}

FoundSurface SurfaceQueries::Candidate::found(const Vec3d& position, const Vec3d& normal, double distance_m) const {
  return {body, frame.to_world(position), frame.rotation * normal, distance_m, {}};
}

// Of two that are as near, the one that comes first among those asked about.
template <class Distance, class Find>
std::optional<FoundSurface> SurfaceQueries::least(double within_m, const Distance& distance_m, const Find& find) {
  order_.clear();
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    const std::optional<double> least_m = candidates_[i].is_endless() ? 0.0 : distance_m(candidates_[i].box);
    if (least_m && *least_m <= within_m) order_.emplace_back(*least_m, i);
  }
  std::ranges::sort(order_);
  std::optional<FoundSurface> found;
  std::pair<double, std::size_t> best(within_m, candidates_.size());
  for (const auto& [least_m, i] : order_) {
    if (least_m > best.first) break;
    std::optional<FoundSurface> next = find(candidates_[i]);
    if (!next || std::pair(std::abs(next->distance_m), i) >= best) continue;
    best = {std::abs(next->distance_m), i};
    found = std::move(next);
  }
  return found;
}

std::optional<FoundSurface> SurfaceQueries::first_hit(const Ray& ray, double length_m) {
  return least(
      length_m, [&](const FaceTree::Box& box) { return box.entered_m(ray); },
      [&](Candidate& candidate) { return hit(candidate, ray); });
}

std::optional<FoundSurface> SurfaceQueries::nearest(const Vec3d& point, double within_m) {
  return least(
      within_m, [&](const FaceTree::Box& box) { return std::optional(box.distance_m(point)); },
      [&](Candidate& candidate) { return std::optional(nearest_of(candidate, point)); });
}

std::optional<FoundSurface> SurfaceQueries::hit(Candidate& candidate, const Ray& ray) {
  if (candidate.body.kind == BodyKind::soft) {
    Skin& skin = candidate.skin;
    const auto met = first_hit_in(skin.take_tree(looks_), skin.surface(), ray, &looks_);
    if (!met) return std::nullopt;
    return FoundSurface{candidate.body, met->position_m, unit_normal(skin.surface(), met->face), met->distance_m,
                        FoundSurface::OnFace{met->face, met->barycentric}};
  }
  const Frame& frame = candidate.frame;
  const Ray local{frame.to_local(ray.origin_m), frame.rotation.transpose() * ray.direction};
  if (candidate.mesh != nullptr) {
    const FacesAt surface = candidate.mesh->surface();
    const auto met = first_hit_in(candidate.mesh->faces, surface, local, &looks_);
    if (!met) return std::nullopt;
    return candidate.found(met->position_m, unit_normal(surface, met->face), met->distance_m);
  }
  const auto distance_m = surface_hit_m(*candidate.shape, local);
  if (!distance_m) return std::nullopt;
  const Vec3d position = local.origin_m + *distance_m * local.direction.stableNormalized();
  return candidate.found(position, nearest_surface(*candidate.shape, position).normal, *distance_m);
}

FoundSurface SurfaceQueries::nearest_of(Candidate& candidate, const Vec3d& point) {
  if (candidate.body.kind == BodyKind::soft) {
    Skin& skin = candidate.skin;
    const MeshPoint at = nearest_in(skin.take_tree(looks_), skin.surface(), point, &looks_);
    return {candidate.body, at.position_m, unit_normal(skin.surface(), at.face),
            inside_or_out(skin.surface(), at, point, skin.mesh->closed), FoundSurface::OnFace{at.face, at.barycentric}};
  }
  const Vec3d local = candidate.frame.to_local(point);
  if (candidate.mesh != nullptr) {
    const FacesAt surface = candidate.mesh->surface();
    const MeshPoint at = nearest_in(candidate.mesh->faces, surface, local, &looks_);
    return candidate.found(at.position_m, unit_normal(surface, at.face),
                           inside_or_out(surface, at, local, candidate.mesh->mesh->closed));
  }
  const SurfacePoint at = nearest_surface(*candidate.shape, local);
  return candidate.found(at.point, at.normal, at.distance_m);
}

const FaceTree& SurfaceQueries::Skin::take_tree(std::uint64_t& looks) {
  const bool is_worth_it = questions++ >= questions_worth_a_tree;
  if (tree.nodes.empty() || (is_worth_it && !is_split)) {
    tree = is_worth_it ? make_face_tree(surface()) : one_leaf(surface());
    is_split = is_worth_it;
    if (is_split) looks += questions_worth_a_tree * mesh->faces.size();
  }
  return tree;
}

}  // namespace pneuma::physics
