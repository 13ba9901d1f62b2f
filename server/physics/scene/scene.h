// A scene as the engine takes it: every default filled in, meshes built. Checked by admission.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "physics/mesh/mesh.h"

namespace pneuma::physics {

struct Polyhedron;

using Vec3d = Eigen::Vector3d;
using Quatd = Eigen::Quaterniond;

inline constexpr double gas_constant_j_mol_k = 8.31446261815324;

enum class Integrator { explicit_euler, midpoint, rk4, symplectic_euler, implicit_euler, tr_bdf2, xpbd, automatic };
/// Whether a step ends where the forces before and within it say; the others solve for the end.
[[nodiscard]] constexpr bool is_explicit(Integrator integrator) {
  return integrator <= Integrator::symplectic_euler;
}
enum class OnUnstable { refuse, substep, allow };
enum class Precision { single_precision, double_precision };

struct Stepping {
  double rate_hz = 60.0;
  std::uint32_t substeps = 0;  // 0: chosen from the stiffness (step_choice.h)
  Integrator integrator = Integrator::midpoint;
  Precision precision = Precision::double_precision;
  double error_target = 0.01;
  std::uint32_t newton_iterations = 1;  // of implicit_euler and tr_bdf2
  OnUnstable on_unstable = OnUnstable::refuse;
  bool sleep = true;  // bodies at rest do (sleep.h)
  bool operator==(const Stepping&) const = default;
};

struct Atmosphere {
  double pressure_pa = 0.0;
  double density_kg_m3 = 0.0;
  Vec3d wind = Vec3d::Zero();  // m/s
  bool operator==(const Atmosphere&) const = default;
};

struct Springs {
  double stiffness_n_m = 0.0;
  double damping_n_s_m = 0.0;
  double rest_scale = 1.0;
  double bend_stiffness_n_m = 0.0;                  // N m a radian (hinge.h)
  std::vector<double> vertex_stiffness_scale = {};  // one a vertex of the mesh; empty: all 1

  /// What stiffness_n_m is multiplied by along this edge: the mean of its ends'.
  [[nodiscard]] double stiffness_scale(const Edge& edge) const {
    return vertex_stiffness_scale.empty() ? 1.0
                                          : 0.5 * (vertex_stiffness_scale[edge[0]] + vertex_stiffness_scale[edge[1]]);
  }
  bool operator==(const Springs&) const = default;
};

enum class GasLaw { isothermal, adiabatic };

struct Gas {
  double moles = 0.0;
  double temperature_k = 293.15;
  GasLaw law = GasLaw::isothermal;
  double heat_capacity_ratio = 1.4;
  double flow_mol_s = 0.0;
  double leak_mol_s_pa = 0.0;
  std::optional<double> burst_pressure_pa = std::nullopt;  // over the outside
  bool operator==(const Gas&) const = default;
};

enum class VolumeMethod { exact, box, ball, ellipsoid, subdivided, monte_carlo };
/// How the gas's volume is measured.
struct Volume {
  VolumeMethod method = VolumeMethod::exact;
  std::uint32_t resolution = 0;  // of subdivided and monte_carlo: cells along an edge of the box, samples in it
  bool operator==(const Volume&) const = default;
};
enum class PressureSpread { faces, vertex_normals };

// An empty optional leaves the decision to the other surface (see combine in contact.h).
struct Surface {
  std::optional<double> restitution;
  std::optional<double> friction;
  double thickness_m = 0.0;
  bool operator==(const Surface&) const = default;
};

struct Drag {
  double normal = 0.0;
  double tangential = 0.0;
  bool operator==(const Drag&) const = default;
};

/// By bounding volumes, as in the paper, or by the surfaces themselves. Two bodies meet by their surfaces if both ask
/// to.
enum class SoftCollision { none, bounds, exact };
enum class BoundsKind { box, ball, ellipsoid };

struct Collision {
  SoftCollision soft = SoftCollision::exact;
  bool self = false;  // the surface does not run through itself
  BoundsKind bounds = BoundsKind::ellipsoid;
  bool operator==(const Collision&) const = default;
};

struct SoftBody {
  std::string name;
  std::shared_ptr<const Mesh> mesh;
  Vec3d position = Vec3d::Zero();
  Quatd orientation = Quatd::Identity();
  Vec3d velocity = Vec3d::Zero();
  Vec3d angular_velocity = Vec3d::Zero();
  double mass_kg = 1.0;
  Springs springs;
  std::optional<Gas> gas;
  Volume volume;
  PressureSpread pressure_spread = PressureSpread::faces;
  Surface surface;
  std::vector<std::uint32_t> pins;
  bool pin_boundary = false;
  Drag drag;
  Collision collision;
  std::vector<double> vertex_mass_scale;  // a vertex's share of mass_kg, over any sum; empty: all have the same
  std::vector<Vec3d> start_positions_m;   // of the mesh's vertices, in the body's frame; empty: the mesh's own

  [[nodiscard]] const std::vector<Vec3d>& start_shape_m() const {
    return start_positions_m.empty() ? mesh->positions_m : start_positions_m;
  }
};

struct PlaneShape {
  Vec3d normal = Vec3d::UnitY();  // unit length, in the shape's own frame
  bool operator==(const PlaneShape&) const = default;
};
struct SphereShape {
  double radius_m = 0.0;
  bool operator==(const SphereShape&) const = default;
};
struct BoxShape {
  Vec3d half_extents_m = Vec3d::Zero();
  bool operator==(const BoxShape&) const = default;
};
struct EllipsoidShape {
  Vec3d radii_m = Vec3d::Zero();
  bool operator==(const EllipsoidShape&) const = default;
};
struct CapsuleShape {
  double radius_m = 0.0;
  double half_height_m = 0.0;
  bool operator==(const CapsuleShape&) const = default;
};
struct RoomShape {
  Vec3d half_extents_m = Vec3d::Zero();
  bool operator==(const RoomShape&) const = default;
};
/// A triangle mesh, met from both sides; of colliders only.
struct MeshShape {
  std::string name;  // among the scene's meshes
  std::shared_ptr<const Mesh> mesh;
  bool operator==(const MeshShape&) const = default;
};
/// A closed convex mesh, filled; of rigid bodies only. Its own frame has the mesh's axes and begins at its centre of
/// mass.
struct ConvexShape {
  std::string name;  // among the scene's meshes
  std::shared_ptr<const Mesh> mesh;
  std::shared_ptr<const Polyhedron> solid;  // made of it (polyhedron.h)
  bool operator==(const ConvexShape& other) const { return name == other.name && mesh == other.mesh; }
};
using Shape =
    std::variant<PlaneShape, SphereShape, BoxShape, EllipsoidShape, CapsuleShape, RoomShape, MeshShape, ConvexShape>;

/// Axes of the world: those along which a body does not move, and those about which it does not turn.
struct LockedAxes {
  std::array<bool, 3> translation{};
  std::array<bool, 3> rotation{};
  bool operator==(const LockedAxes&) const = default;
};

struct RigidBody {
  std::string name;
  Shape shape;  // sphere, box, capsule or convex mesh
  double mass_kg = 1.0;
  Vec3d position = Vec3d::Zero();
  Quatd orientation = Quatd::Identity();
  Vec3d velocity = Vec3d::Zero();
  Vec3d angular_velocity = Vec3d::Zero();
  Surface surface;
  LockedAxes locked = {};
};

struct Collider {
  std::string name;
  Shape shape;
  Vec3d position = Vec3d::Zero();
  Quatd orientation = Quatd::Identity();
  Vec3d velocity = Vec3d::Zero();
  Vec3d angular_velocity = Vec3d::Zero();
  Surface surface;
};

/// A point that a joint holds.
struct Anchor {
  enum class Of { world, soft, rigid, collider };
  Of of = Of::world;
  std::string body = {};  // its name
  // Of a soft body: a vertex, or a point of a face by the weights of its three vertices.
  std::optional<std::uint32_t> vertex = {};
  std::optional<std::uint32_t> face = {};
  Vec3d face_weights = Vec3d::Zero();
  // Of the others, in the body's own frame or the world's. Unset in a joint's first: the origin; in its second: where
  // the first is when the joint is made.
  std::optional<Vec3d> point_m = {};
  bool operator==(const Anchor&) const = default;
};

struct PointJoint {
  bool operator==(const PointJoint&) const = default;
};
/// A rope: no further apart than this.
struct DistanceLimit {
  double longest_m = 0.0;
  bool operator==(const DistanceLimit&) const = default;
};
/// The two turn about one axis, of unit length and in the first's frame, and do nothing else.
struct HingeJoint {
  Vec3d axis = Vec3d::UnitY();
  bool operator==(const HingeJoint&) const = default;
};
/// The two move along one axis and do not turn.
struct SliderJoint {
  Vec3d axis = Vec3d::UnitY();
  bool operator==(const SliderJoint&) const = default;
};
using JointKind = std::variant<PointJoint, DistanceLimit, HingeJoint, SliderJoint>;

struct Joint {
  std::string name;
  Anchor first;
  Anchor second;
  JointKind kind;
  double compliance_m_n = 0.0;                                     // 0: rigid
  double break_force_n = std::numeric_limits<double>::infinity();  // past it the joint is gone
  bool operator==(const Joint&) const = default;
};

struct Scene {
  std::string name;
  Vec3d gravity = Vec3d::Zero();  // m/s^2
  Stepping stepping;
  Atmosphere atmosphere;
  std::vector<SoftBody> soft_bodies;
  std::vector<RigidBody> rigid_bodies;
  std::vector<Collider> colliders;
  std::vector<Joint> joints;
};

}  // namespace pneuma::physics
