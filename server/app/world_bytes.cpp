#include "app/world_bytes.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "app/factor_size.h"
#include "base/limits.h"
#include "physics/choice/step_choice.h"

namespace pneuma::app {

namespace {

using physics::Integrator;

// Measured on balls and sheets of 12 to 40,962 vertices, in double precision, over some ticks; tests hold the sums to
// what the allocator says.
constexpr std::size_t mesh_bytes_per_vertex = 300;  // rings, lanes' tables, topologies
constexpr std::size_t body_bytes = 6 * 1024;
constexpr std::size_t body_bytes_per_vertex = 500;
// Within a tick; most of it is others' between ticks (physics/machine/room_pool.h). Features that are near each other
// are most in a heap, or in a skin that folds on itself.
constexpr std::size_t contact_bytes_per_vertex = 3'500;
constexpr std::size_t self_contact_bytes_per_vertex = 8'000;
// Of a skin that has solids alone to touch: most in a sheet that lies on a floor.
constexpr std::size_t solid_contact_bytes_per_vertex = 1'500;
constexpr std::size_t implicit_bytes_per_vertex = 1'100;
constexpr std::size_t matrix_bytes_per_vertex = 140;
// As it is kept, and as Eigen holds it while it is made.
constexpr std::size_t factor_entry_bytes = 12 + 16;
// Small factors are held by rows too.
constexpr std::size_t small_factor_entries = 65'536;
constexpr std::size_t solid_bytes = 4 * 1024;
constexpr std::size_t joint_bytes = 2 * 1024;
constexpr std::size_t stream_bytes_per_vertex_plain = 550;

/// By vertices, or by faces where it has more than two of them a vertex.
std::size_t size_of(const physics::Mesh& mesh) {
  return std::max(mesh.positions_m.size(), mesh.faces.size() / 2);
}

/// Planes and rooms have none that a skin's edges could meet.
bool has_edges(const std::vector<physics::Collider>& colliders) {
  return std::ranges::any_of(colliders, [](const physics::Collider& collider) {
    return !std::holds_alternative<physics::PlaneShape>(collider.shape) &&
           !std::holds_alternative<physics::RoomShape>(collider.shape);
  });
}

/// Bodies that are alike in all of these share a matrix.
auto likeness(const physics::SoftBody& body) {
  const double moles = body.gas ? body.gas->moles * body.gas->temperature_k : 0.0;
  return std::tuple(body.mesh.get(), body.mass_kg, body.springs.stiffness_n_m, body.springs.damping_n_s_m,
                    body.springs.rest_scale, body.springs.bend_stiffness_n_m, body.springs.vertex_stiffness_scale,
                    body.pins, body.pin_boundary, body.vertex_mass_scale, moles);
}

}  // namespace

std::size_t WorldBytes::by(Integrator integrator) const {
  if (integrator == Integrator::automatic) return std::max(as_explicit, as_implicit);
  return integrator == Integrator::implicit_euler || integrator == Integrator::tr_bdf2 ? as_implicit : as_explicit;
}

std::size_t WorldEstimates::factor_entries_of(const MeshPtr& mesh) {
  const auto [known, is_new] = factor_entries_.try_emplace(mesh, 0);
  if (is_new) known->second = factor_entries(*mesh, base::factor_entries_max);
  return known->second;
}

base::Result<WorldBytes> WorldEstimates::of(const v1::Scene& source, const physics::Scene& scene) {
  const Integrator integrator = scene.stepping.integrator;
  const bool may_be_implicit = integrator == Integrator::automatic || integrator == Integrator::implicit_euler ||
                               integrator == Integrator::tr_bdf2;
  const bool meets_others = scene.soft_bodies.size() + scene.rigid_bodies.size() > 1 || has_edges(scene.colliders);
  const bool touches = meets_others || !scene.colliders.empty();
  WorldBytes bytes;
  // The scene as it was created, as it is, and as bytes of a checkpoint.
  bytes.as_explicit = 3 * source.SpaceUsedLong();
  bytes.as_explicit += solid_bytes * (scene.rigid_bodies.size() + scene.colliders.size());
  bytes.as_explicit += joint_bytes * scene.joints.size();
  std::set<MeshPtr> meshes;
  for (const physics::Collider& collider : scene.colliders) {
    if (const auto* shape = std::get_if<physics::MeshShape>(&collider.shape)) meshes.insert(shape->mesh);
  }
  std::set<decltype(likeness(scene.soft_bodies.front()))> matrices;
  std::size_t implicit_bytes = 0;
  for (std::size_t i = 0; i < scene.soft_bodies.size(); ++i) {
    const physics::SoftBody& body = scene.soft_bodies[i];
    const std::size_t size = size_of(*body.mesh);
    meshes.insert(body.mesh);
    bytes.vertices += body.mesh->positions_m.size();
    bytes.as_explicit += body_bytes + size * body_bytes_per_vertex;
    if (body.collision.self) bytes.as_explicit += size * self_contact_bytes_per_vertex;
    if (meets_others && body.collision.soft != physics::SoftCollision::none) {
      bytes.as_explicit += size * contact_bytes_per_vertex;
    } else if (touches) {
      bytes.as_explicit += size * solid_contact_bytes_per_vertex;
    }
    if (!may_be_implicit) continue;
    implicit_bytes += size * implicit_bytes_per_vertex;
    if (!matrices.insert(likeness(body)).second) continue;
    const std::size_t entries = factor_entries_of(body.mesh);
    if (entries > base::factor_entries_max) {
      return base::Status(base::StatusCode::limit_exceeded,
                          "the mesh is folded so that an implicit step would have a matrix of more than " +
                              std::to_string(base::factor_entries_max) +
                              " entries once it is factored; an explicit integrator takes it",
                          "soft_bodies[" + std::to_string(i) + "].mesh");
    }
    const std::size_t factor_bytes = entries * factor_entry_bytes * (entries <= small_factor_entries ? 2 : 1);
    const bool couples = (touches || body.collision.self) && size <= physics::coupled_vertices_max;
    const std::size_t kinds = 1 + (couples ? 1U : 0U) + (integrator == Integrator::implicit_euler ? 0U : 1U);
    implicit_bytes += kinds * (factor_bytes + size * matrix_bytes_per_vertex);
    // The columns of its inverse, as contacts ask for them; and those of its rows, where it may lie on something as a
    // whole. Rows of a closed skin are on less than half of it.
    if (couples) implicit_bytes += size * size * sizeof(double) * (body.mesh->closed ? 1 : 2);
  }
  std::erase_if(factor_entries_, [&](const auto& known) { return !meshes.contains(known.first); });
  for (const MeshPtr& mesh : meshes) bytes.as_explicit += size_of(*mesh) * mesh_bytes_per_vertex;
  bytes.as_implicit = bytes.as_explicit + implicit_bytes;
  return bytes;
}

double stream_bytes_per_vertex(bool velocities, bool time_layers, std::uint32_t level_of_detail) {
  return static_cast<double>(stream_bytes_per_vertex_plain) * (velocities ? 2.0 : 1.0) * (time_layers ? 3.0 : 1.0) *
         std::pow(0.25, level_of_detail);
}

}  // namespace pneuma::app
