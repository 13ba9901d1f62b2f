// The live state of a world's bodies. Soft bodies are templated on their scalar (float or double);
// solids are few, and double.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "physics/mesh/hinge.h"
#include "physics/mesh/mesh_tree.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

template <class Real>
using Vec3 = Eigen::Matrix<Real, 3, 1>;

/// What is inside a body now. Pressure follows from it and the volume (gas.h).
struct GasState {
  double moles = 0.0;
  // The temperature at volume_ref_m3; it stays there when isothermal, and follows T V^(g-1) when adiabatic.
  double temperature_ref_k = 0.0;
  double volume_ref_m3 = 0.0;
};

/// What a gas did that others want to hear of.
struct GasEvent {
  enum class Kind { burst, inverted };
  Kind kind = Kind::burst;
  double pressure_pa = 0.0;  // over the outside, when it happened
  double volume_m3 = 0.0;
};

/// A vertex held to a moving point by a damped spring.
struct Grab {
  std::uint64_t id = 0;
  std::uint32_t vertex = 0;
  Vec3d target = Vec3d::Zero();
  double stiffness_n_m = 0.0;
  double damping_n_s_m = 0.0;
};

/// Room for the spread of pressure by vertex normals; empty where it is not used.
template <class Real>
struct NormalSpread {
  std::vector<Vec3<Real>> normal_sums;  // of the unit normals of a vertex's faces
  std::vector<Real> areas_m2;           // a third of their areas
};

/// So many vertices of a body tell about its motion, where all would cost too much.
inline constexpr std::size_t sampled_vertices = 8;

/// Whether a body sleeps, or for how many ticks it has kept a place or been near one (sleep.h).
struct Rest {
  bool asleep = false;
  std::uint32_t ticks = 0;
  std::uint32_t near_ticks = 0;  // with those in the place that it left before
};

template <class Real>
struct SoftState {
  SoftBody body;                     // as the scene has it now
  Real vertex_mass_kg = 0;           // the mean
  std::vector<double> mass_shares;   // vertex_masses.h; empty where all vertices have the mean
  Real length_m = 0;                 // of the mesh: its bounding box's diagonal
  std::vector<Hinge> hinges;         // empty where nothing resists bending
  std::vector<std::uint8_t> pinned;  // one a vertex; empty where none is
  Vec3d origin_m = Vec3d::Zero();    // that x and the places are seen from; 0 in double precision (origin.h)
  std::vector<Vec3<Real>> x;         // positions, m
  std::vector<Vec3<Real>> v;         // velocities, m/s
  std::vector<Vec3<Real>> dr;        // the move of the substep under way, m
  std::optional<GasState> gas;
  NormalSpread<Real> spread;
  double volume_m3 = 0.0;             // by the body's own method, at the last force evaluation
  double pressure_pa = 0.0;           // over the outside, at the last force evaluation
  bool inverted = false;              // the gas's volume was 0 or less, and is not back
  std::optional<GasEvent> gas_event;  // of this substep
  std::vector<Grab> grabs;            // by vertex, those of one vertex side by side
  Rest rest;
  std::vector<Vec3<Real>> place;  // of the vertices when rest.ticks began to count; empty while they do not
  std::array<Vec3<Real>, sampled_vertices> near_place{};  // of the sampled vertices, that it is near
  bool solve_failed = false;                              // the integrator found no finite answer in this substep
  bool is_crowded = false;  // contact left it out of this substep: too much came near (contact/crowding.h)
  bool frozen = false;
  std::uint32_t tie = 0;  // bodies that joints tie together have the same number; 0: none do

  [[nodiscard]] bool is_awake() const { return !frozen && !rest.asleep; }
  [[nodiscard]] std::size_t sampled_vertex(std::size_t k) const { return k * x.size() / sampled_vertices; }
  /// Where the vertex is in the world.
  [[nodiscard]] Vec3d position_m(std::size_t vertex) const { return origin_m + x[vertex].template cast<double>(); }
  [[nodiscard]] Real rest_length_m(std::size_t edge) const {
    return static_cast<Real>(body.springs.rest_scale * body.mesh->edge_lengths_m[edge]);
  }
  [[nodiscard]] double mass_kg(std::size_t vertex) const {
    return static_cast<double>(vertex_mass_kg) * (mass_shares.empty() ? 1.0 : mass_shares[vertex]);
  }
  /// Calls work(share) once, where share(i) is vertex i's mass over the mean: a constant 1 where all are alike, which
  /// costs a loop nothing.
  template <class Work>
  decltype(auto) with_mass_shares(const Work& work) const {
    if (mass_shares.empty()) return work([](std::size_t) { return 1.0; });
    return work([this](std::size_t vertex) { return mass_shares[vertex]; });
  }
  [[nodiscard]] bool is_pinned(std::size_t vertex) const { return !pinned.empty() && pinned[vertex] != 0; }
};

struct RigidState {
  RigidBody body;  // as the scene has it; the live pose is below
  Vec3d position = Vec3d::Zero();
  Quatd orientation = Quatd::Identity();
  Vec3d velocity = Vec3d::Zero();
  Vec3d angular_velocity = Vec3d::Zero();  // rad/s, in the world's frame
  double inverse_mass_1_kg = 0.0;
  Vec3d inverse_inertia_1_kg_m2 = Vec3d::Zero();  // about the principal axes
  std::optional<Quatd> principal_axes;            // in the body's frame; unset: its own
  Rest rest;
  Vec3d place = Vec3d::Zero();  // and the orientation there, when rest.ticks began to count
  Quatd place_orientation = Quatd::Identity();
  Vec3d near_place = Vec3d::Zero();  // that it is near, and the orientation there
  Quatd near_orientation = Quatd::Identity();
  bool has_moved = false;   // in the substep under way, by the contact solver
  bool is_crowded = false;  // as a soft body's
  bool frozen = false;
  std::uint32_t tie = 0;  // likewise

  [[nodiscard]] bool is_awake() const { return !frozen && !rest.asleep; }
};

struct ColliderState {
  Collider collider;  // as the scene has it; the live pose is below
  Vec3d position = Vec3d::Zero();
  Quatd orientation = Quatd::Identity();
  std::shared_ptr<const MeshTree> tree = nullptr;  // of a mesh; none of other shapes
};

}  // namespace pneuma::physics
