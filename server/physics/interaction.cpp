// How a hand reaches into a world: impulses and grabs.
#include <algorithm>
#include <cmath>
#include <set>

#include "base/limits.h"
#include "base/nearest_word.h"
#include "physics/mesh/picking.h"
#include "physics/queries.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/scene/shape.h"
#include "physics/simulation.h"

namespace pneuma::physics {

namespace {

template <class Real>
std::vector<Vec3d> positions_m(const SoftState<Real>& body) {
  std::vector<Vec3d> positions;
  positions.reserve(body.x.size());
  for (std::size_t i = 0; i < body.x.size(); ++i) positions.push_back(body.position_m(i));
  return positions;
}

// Where a ray meets a body, or nothing.
template <class Real>
std::optional<Vec3d> meet(const SoftState<Real>& body, const RayPoint& ray) {
  const std::optional<MeshPoint> hit = first_hit(positions_m(body), body.body.mesh->faces, {ray.origin, ray.direction});
  if (!hit) return std::nullopt;
  return hit->position_m;
}

std::optional<Vec3d> meet(const RigidState& body, const RayPoint& ray) {
  const Quatd to_body = body.orientation.conjugate();
  const Ray local{to_body * (ray.origin - body.position), to_body * ray.direction};
  const auto distance_m = surface_hit_m(body.body.shape, local);
  if (!distance_m) return std::nullopt;
  return Vec3d(ray.origin + *distance_m * ray.direction.stableNormalized());
}

base::Status no_such(const World& world, const std::string& kind, const std::string& name, bool with_rigid) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) names.push_back(world.soft_body(i).name);
  if (with_rigid) {
    for (const RigidState& rigid : world.rigid_bodies()) names.push_back(rigid.body.name);
  }
  return base::not_found("no " + kind + " is named \"" + name + "\"" + base::nearest_or_all(name, names), "body");
}

base::Status misses(const std::string& body) {
  return base::not_found(body.empty() ? "the ray meets no body" : "the ray does not meet \"" + body + "\"", "ray");
}

// The vertices that a request's point stands for, and their shares of the impulse.
template <class Real>
base::Result<std::vector<VertexWeight>> vertices_at(const SoftState<Real>& body, const At& at) {
  if (const auto* vertex = std::get_if<std::uint32_t>(&at)) {
    if (*vertex >= body.x.size()) {
      return base::invalid("\"" + body.body.name + "\" has " + std::to_string(body.x.size()) +
                               " vertices; there is no vertex " + std::to_string(*vertex),
                           "vertex");
    }
    return std::vector<VertexWeight>{{*vertex, 1.0}};
  }
  const std::vector<Vec3d> positions = positions_m(body);
  if (const auto* near = std::get_if<NearPoint>(&at)) {
    const MeshPoint surface = nearest_surface_point(positions, body.body.mesh->faces, near->position);
    return weights_near(positions, surface.position_m, near->radius_m);
  }
  if (const auto* ray = std::get_if<RayPoint>(&at)) {
    const std::optional<Vec3d> hit = meet(body, *ray);
    if (!hit) return misses(body.body.name);
    return weights_near(positions, *hit, ray->radius_m);
  }
  std::vector<VertexWeight> all;
  const double mean = 1.0 / static_cast<double>(body.x.size());
  body.with_mass_shares([&](auto share) {
    for (std::uint32_t i = 0; i < body.x.size(); ++i) all.push_back({i, mean * share(i)});
  });
  return all;
}

std::uint32_t heaviest(const std::vector<VertexWeight>& weights) {
  return std::ranges::max_element(weights, {}, &VertexWeight::weight)->vertex;
}

// Without the pinned vertices. The free ones take their shares, so that the body gets all that was asked for.
template <class Real>
std::vector<VertexWeight> free_shares(const SoftState<Real>& body, std::vector<VertexWeight> weights) {
  std::erase_if(weights, [&](const VertexWeight& share) { return body.is_pinned(share.vertex); });
  double sum = 0.0;
  for (const VertexWeight& share : weights) sum += share.weight;
  for (VertexWeight& share : weights) share.weight /= sum;
  return weights;
}

template <class Real>
base::Result<Hit> push(SoftState<Real>& body, const At& at, const Vec3d& impulse_n_s) {
  if (body.frozen)
    return base::Status(base::StatusCode::failed_precondition, "\"" + body.body.name + "\" is frozen", "body");
  const base::Result<std::vector<VertexWeight>> weights = vertices_at(body, at);
  if (!weights.ok()) return weights.status();
  const std::vector<VertexWeight> shares = free_shares(body, *weights);
  if (shares.empty()) {
    return base::Status(base::StatusCode::failed_precondition,
                        "every vertex of \"" + body.body.name + "\" that it would push is pinned", "at");
  }
  for (const auto& [vertex, share] : shares) {
    body.v[vertex] += (share / body.mass_kg(vertex) * impulse_n_s).template cast<Real>();
  }
  if (std::holds_alternative<WholeBody>(at)) return Hit{body.body.name, std::nullopt};
  return Hit{body.body.name, heaviest(shares)};
}

base::Result<Hit> push(RigidState& body, const At& at, const Vec3d& impulse_n_s) {
  if (body.frozen)
    return base::Status(base::StatusCode::failed_precondition, "\"" + body.body.name + "\" is frozen", "body");
  Vec3d point = body.position;
  if (std::holds_alternative<std::uint32_t>(at)) {
    return base::invalid("\"" + body.body.name + "\" is a rigid body: it has no vertices", "vertex");
  }
  if (const auto* near = std::get_if<NearPoint>(&at)) {
    const Frame frame(body.position, body.orientation);
    point = frame.to_world(nearest_surface(body.body.shape, frame.to_local(near->position)).point);
  }
  if (const auto* ray = std::get_if<RayPoint>(&at)) {
    const std::optional<Vec3d> hit = meet(body, *ray);
    if (!hit) return misses(body.body.name);
    point = *hit;
  }
  body.velocity += inverse_masses_1_kg(body).cwiseProduct(impulse_n_s);
  body.angular_velocity += inverse_inertia_times(body, (point - body.position).cross(impulse_n_s));
  return Hit{body.body.name, std::nullopt};
}

base::Result<std::string> named_body(const World& world, const std::string& body, const At& at, bool with_rigid) {
  if (!body.empty()) return body;
  const auto* ray = std::get_if<RayPoint>(&at);
  if (ray == nullptr) return base::invalid("no body is named; only a ray may leave it open", "body");
  std::vector<BodyRef> bodies = all_bodies(world);
  std::erase_if(bodies, [&](BodyRef each) { return each.kind > (with_rigid ? BodyKind::rigid : BodyKind::soft); });
  const auto first = SurfaceQueries(world, bodies).first_hit({ray->origin, ray->direction});
  return first ? base::Result(name_of(world, first->body)) : misses({});
}

// Calls `visitor` with the state of the soft body of that name and gives what it returns; nothing where there is none.
template <class Sim, class Visitor>
auto with_soft_body(Sim& sim, const std::string& name, const Visitor& visitor) {
  return sim.visit([&](auto& bodies) {
    const auto found = std::ranges::find_if(bodies.states, [&](const auto& body) { return body.body.name == name; });
    using Outcome = std::optional<decltype(visitor(*found))>;
    return found == bodies.states.end() ? Outcome{} : Outcome{visitor(*found)};
  });
}

// Calls `visitor` with the list that has the springs of grab `id`; false where nobody holds it.
template <class Visitor>
bool with_grab(Simulation& sim, std::uint64_t id, const Visitor& visitor) {
  return sim.visit([&](auto& bodies) {
    for (auto& body : bodies.states) {
      if (std::ranges::find(body.grabs, id, &Grab::id) == body.grabs.end()) continue;
      visitor(body.grabs);
      return true;
    }
    return false;
  });
}

template <class Real>
std::size_t hands_on(const SoftState<Real>& body) {
  std::set<std::uint64_t> ids;
  for (const Grab& grab : body.grabs) ids.insert(grab.id);
  return ids.size();
}

// What is held with a vertex, and its share of the stiffness.
template <class Real>
base::Result<std::vector<VertexWeight>> patch_of(const SoftState<Real>& body, std::uint32_t vertex, double radius_m) {
  const std::size_t room = base::body_held_vertices_max - std::min(body.grabs.size(), base::body_held_vertices_max);
  const std::string most = std::to_string(base::body_held_vertices_max) + " vertices of \"" + body.body.name + "\"";
  if (room == 0) return base::Status(base::StatusCode::limit_exceeded, "grabs hold " + most + " already");
  const std::vector<VertexWeight> patch =
      weights_along_skin(positions_m(body), body.body.mesh->edges, vertex, radius_m, room);
  if (patch.size() > room) {
    return base::Status(
        base::StatusCode::limit_exceeded,
        "takes in more than " + std::to_string(room) + " vertices; grabs may hold " + most + " together", "radius_m");
  }
  return free_shares(body, patch);
}

base::Status no_grab(std::uint64_t id) {
  return base::not_found("no grab has the id " + std::to_string(id), "grab_id");
}

}  // namespace

base::Result<Hit> World::apply_impulse(const std::string& body, const At& at, const Vec3d& impulse_n_s) {
  const base::Result<std::string> name = named_body(*this, body, at, true);
  if (!name.ok()) return name.status();
  auto soft = with_soft_body(*simulation_, *name, [&](auto& state) { return push(state, at, impulse_n_s); });
  if (soft && soft->ok()) simulation_->wake(*name);
  if (soft) return std::move(*soft);
  const auto rigid =
      std::ranges::find_if(simulation_->rigid, [&](const RigidState& state) { return state.body.name == *name; });
  if (rigid == simulation_->rigid.end()) return no_such(*this, "body", *name, true);
  base::Result<Hit> hit = push(*rigid, at, impulse_n_s);
  if (hit.ok()) simulation_->wake(*name);
  return hit;
}

base::Result<Hit> World::add_grab(std::uint64_t id, const std::string& body, const At& at, const Hold& hold) {
  const base::Result<std::string> name = named_body(*this, body, at, false);
  if (!name.ok()) return name.status();
  auto held = with_soft_body(*simulation_, *name, [&](auto& state) -> base::Result<Hit> {
    if (state.frozen) {
      return base::Status(base::StatusCode::failed_precondition, "\"" + state.body.name + "\" is frozen", "body");
    }
    if (std::holds_alternative<WholeBody>(at)) return base::invalid("a grab needs a vertex, a point or a ray", "at");
    const base::Result<std::vector<VertexWeight>> weights = vertices_at(state, at);
    if (!weights.ok()) return weights.status();
    const std::uint32_t vertex = heaviest(*weights);
    if (state.is_pinned(vertex)) return base::invalid("vertex " + std::to_string(vertex) + " is pinned", "vertex");
    if (hands_on(state) >= base::body_grabs_max) {
      return base::Status(
          base::StatusCode::limit_exceeded,
          "\"" + state.body.name + "\" is held by " + std::to_string(base::body_grabs_max) + " grabs already");
    }
    const base::Result<std::vector<VertexWeight>> patch = patch_of(state, vertex, hold.radius_m);
    if (!patch.ok()) return patch.status();
    simulation_->wake(state.body.name);
    const Vec3d centre = state.position_m(vertex);
    for (const auto& [at_vertex, share] : *patch) {
      Grab grab{.id = id, .vertex = at_vertex};
      grab.target = hold.target + (state.position_m(at_vertex) - centre);
      grab.stiffness_n_m = share * (hold.stiffness_n_m > 0.0 ? hold.stiffness_n_m : state.body.springs.stiffness_n_m);
      const double critical_n_s_m = 2.0 * std::sqrt(grab.stiffness_n_m * state.mass_kg(at_vertex));
      grab.damping_n_s_m = hold.damping_n_s_m > 0.0 ? share * hold.damping_n_s_m : critical_n_s_m;
      state.grabs.insert(std::ranges::upper_bound(state.grabs, at_vertex, {}, &Grab::vertex), grab);
    }
    return Hit{state.body.name, vertex};
  });
  if (!held) return no_such(*this, "soft body", *name, false);
  return std::move(*held);
}

// The hand is at the target of the vertex that was grabbed. That one is held hardest.
base::Status World::move_grab(std::uint64_t id, const Vec3d& target) {
  const bool found = with_grab(*simulation_, id, [&](std::vector<Grab>& grabs) {
    const auto hardness = [id](const Grab& grab) { return grab.id == id ? grab.stiffness_n_m : -1.0; };
    const Vec3d hand = std::ranges::max_element(grabs, {}, hardness)->target;
    for (Grab& grab : grabs) {
      if (grab.id == id) grab.target = target + (grab.target - hand);
    }
  });
  return found ? base::Status() : no_grab(id);
}

base::Status World::release_grab(std::uint64_t id) {
  const bool found = with_grab(*simulation_, id, [id](std::vector<Grab>& grabs) {
    std::erase_if(grabs, [id](const Grab& grab) { return grab.id == id; });
  });
  return found ? base::Status() : no_grab(id);
}

}  // namespace pneuma::physics
