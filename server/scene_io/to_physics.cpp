#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <string>
#include <utility>

#include <google/protobuf/generated_enum_reflection.h>

#include "base/limits.h"
#include "physics/mesh/polyhedron.h"
#include "physics/scene/admission.h"
#include "scene_io/translate.h"

namespace pneuma::scene_io {
namespace {

using base::Result;
using base::Status;
using base::StatusCode;
using physics::Quatd;
using physics::Vec3d;

/// Keeps the first failure of a message's fields.
class Failures {
 public:
  void note(const char* field, const Status& status) {
    if (first_.ok() && !status.ok()) first_ = status.inside(field);
  }
  [[nodiscard]] const Status& first() const { return first_; }

 private:
  Status first_;
};

Vec3d to_vector(const v1::Vec3& in) {
  return {in.x(), in.y(), in.z()};
}

/// Scaled to length 1, without overflow or underflow on the way; what has that length to round-off keeps its bits, so
/// that a live pose goes through a message unchanged. All zero, which is how a message says nothing, gives `otherwise`.
template <class Vector>
Status normalise(Vector in, const Vector& otherwise, Vector& out) {
  if (!in.allFinite()) return base::invalid("is not finite");
  const double largest = in.cwiseAbs().maxCoeff();
  if (std::abs(in.squaredNorm() - 1.0) <= 4.0 * std::numeric_limits<double>::epsilon()) {
    out = in;
    return {};
  }
  out = largest == 0.0 ? otherwise : (in / largest).normalized();
  return {};
}

Status read_rotation(const v1::Quaternion& in, Quatd& out) {
  using Coefficients = Quatd::Coefficients;  // x, y, z, w
  return normalise<Coefficients>({in.x(), in.y(), in.z(), in.w()}, Quatd::Identity().coeffs(), out.coeffs());
}

/// What is in `known` is what this version builds; the first pair is the default. Messages from the wire may hold any
/// number.
template <class Proto, class Physics>
Status read_enum(Proto value, std::initializer_list<std::pair<Proto, Physics>> known, Physics& out) {
  if (static_cast<int>(value) == 0) {
    out = known.begin()->second;
    return {};
  }
  const auto* type = google::protobuf::GetEnumDescriptor<Proto>();
  const auto name = [type](Proto number) {
    const auto* its = type->FindValueByNumber(static_cast<int>(number));
    return its == nullptr ? std::to_string(static_cast<int>(number)) : its->name();
  };
  std::string names;
  for (const auto& [its, meaning] : known) {
    if (its == value) {
      out = meaning;
      return {};
    }
    names += (names.empty() ? "" : ", ") + name(its);
  }
  return {StatusCode::unsupported, "this version has no " + name(value) + "; it has " + names};
}

Status read_stepping(const v1::Stepping& in, physics::Stepping& out) {
  using enum physics::Integrator;
  using enum physics::Precision;
  if (in.has_rate_hz()) out.rate_hz = in.rate_hz();
  out.substeps = in.substeps();
  if (in.has_error_target()) out.error_target = in.error_target();
  if (in.has_sleep()) out.sleep = in.sleep();
  if (in.has_newton_iterations()) out.newton_iterations = in.newton_iterations();
  Failures failures;
  failures.note("integrator", read_enum(in.integrator(),
                                        {{v1::Stepping::AUTO, automatic},
                                         {v1::Stepping::MIDPOINT, midpoint},
                                         {v1::Stepping::EXPLICIT_EULER, explicit_euler},
                                         {v1::Stepping::RK4, rk4},
                                         {v1::Stepping::SYMPLECTIC_EULER, symplectic_euler},
                                         {v1::Stepping::IMPLICIT_EULER, implicit_euler},
                                         {v1::Stepping::TR_BDF2, tr_bdf2},
                                         {v1::Stepping::XPBD, xpbd}},
                                        out.integrator));
  failures.note(
      "precision",
      read_enum(in.precision(), {{v1::Stepping::DOUBLE, double_precision}, {v1::Stepping::SINGLE, single_precision}},
                out.precision));
  using physics::OnUnstable;
  failures.note("on_unstable", read_enum(in.on_unstable(),
                                         {{v1::Stepping::REFUSE, OnUnstable::refuse},
                                          {v1::Stepping::SUBSTEP, OnUnstable::substep},
                                          {v1::Stepping::ALLOW, OnUnstable::allow}},
                                         out.on_unstable));
  return failures.first();
}

void read_springs(const v1::Springs& in, physics::Springs& out) {
  out.stiffness_n_m = in.stiffness_n_m();
  out.damping_n_s_m = in.damping_n_s_m();
  if (in.has_rest_scale()) out.rest_scale = in.rest_scale();
  out.bend_stiffness_n_m = in.bend_stiffness_n_m();
  out.vertex_stiffness_scale.assign(in.vertex_stiffness_scale().begin(), in.vertex_stiffness_scale().end());
}

Status read_gas(const v1::Gas& in, physics::Gas& out) {
  out.moles = in.moles();
  if (in.has_temperature_k()) out.temperature_k = in.temperature_k();
  if (in.has_heat_capacity_ratio()) out.heat_capacity_ratio = in.heat_capacity_ratio();
  out.flow_mol_s = in.flow_mol_s();
  out.leak_mol_s_pa = in.leak_mol_s_pa();
  if (in.has_burst_pressure_pa()) out.burst_pressure_pa = in.burst_pressure_pa();
  using enum physics::GasLaw;
  Failures failures;
  failures.note("law",
                read_enum(in.law(), {{v1::Gas::ISOTHERMAL, isothermal}, {v1::Gas::ADIABATIC, adiabatic}}, out.law));
  return failures.first();
}

Status read_volume(const v1::Volume& in, physics::Volume& out) {
  using enum physics::VolumeMethod;
  Failures failures;
  failures.note("method", read_enum(in.method(),
                                    {{v1::Volume::EXACT, exact},
                                     {v1::Volume::BOX, box},
                                     {v1::Volume::BALL, ball},
                                     {v1::Volume::ELLIPSOID, ellipsoid},
                                     {v1::Volume::SUBDIVIDED, subdivided},
                                     {v1::Volume::MONTE_CARLO, monte_carlo}},
                                    out.method));
  out.resolution = in.resolution();
  if (out.resolution == 0 && out.method == subdivided) out.resolution = base::volume_subdivisions_default;
  if (out.resolution == 0 && out.method == monte_carlo) out.resolution = base::volume_samples_default;
  return failures.first();
}

Status read_collision(const v1::Collision& in, physics::Collision& out) {
  using physics::BoundsKind;
  using physics::SoftCollision;
  Failures failures;
  failures.note("soft", read_enum(in.soft(),
                                  {{v1::Collision::EXACT, SoftCollision::exact},
                                   {v1::Collision::BOUNDS, SoftCollision::bounds},
                                   {v1::Collision::NONE, SoftCollision::none}},
                                  out.soft));
  out.self = in.self();
  failures.note("bounds", read_enum(in.bounds(),
                                    {{v1::Collision::Bounds::Collision_Bounds_ELLIPSOID, BoundsKind::ellipsoid},
                                     {v1::Collision::Bounds::Collision_Bounds_BOX, BoundsKind::box},
                                     {v1::Collision::Bounds::Collision_Bounds_BALL, BoundsKind::ball}},
                                    out.bounds));
  return failures.first();
}

physics::Surface to_surface(const v1::Surface& in) {
  physics::Surface out;
  if (in.has_restitution()) out.restitution = in.restitution();
  if (in.has_friction()) out.friction = in.friction();
  out.thickness_m = in.thickness_m();
  return out;
}

Status read_shape(const v1::Shape& in, const MeshLibrary& meshes, physics::Shape& out) {
  switch (in.shape_case()) {
    case v1::Shape::kPlane: {
      physics::PlaneShape plane;
      const Status status = normalise<Vec3d>(to_vector(in.plane().normal()), Vec3d::UnitY(), plane.normal);
      out = plane;
      return status.ok() ? status : status.inside("plane.normal");
    }
    case v1::Shape::kSphere:
      out = physics::SphereShape{in.sphere().radius_m()};
      return {};
    case v1::Shape::kBox:
      out = physics::BoxShape{to_vector(in.box().half_extents())};
      return {};
    case v1::Shape::kEllipsoid:
      out = physics::EllipsoidShape{to_vector(in.ellipsoid().radii())};
      return {};
    case v1::Shape::kCapsule:
      out = physics::CapsuleShape{in.capsule().radius_m(), in.capsule().half_height_m()};
      return {};
    case v1::Shape::kRoom:
      out = physics::RoomShape{to_vector(in.room().half_extents())};
      return {};
    case v1::Shape::kMesh: {
      auto mesh = meshes.find(in.mesh());
      if (!mesh.ok()) return mesh.status().inside("mesh");
      out = physics::MeshShape{in.mesh(), std::move(*mesh)};
      return {};
    }
    case v1::Shape::SHAPE_NOT_SET:
      break;
  }
  return base::invalid("is missing; one of plane, sphere, box, ellipsoid, capsule, room, mesh is wanted");
}

/// What soft bodies, rigid bodies and colliders have alike.
template <class In, class Out>
void read_motion(const In& in, Out& out, Failures& failures) {
  out.name = in.name();
  out.position = to_vector(in.position());
  failures.note("orientation", read_rotation(in.orientation(), out.orientation));
  out.velocity = to_vector(in.velocity());
  out.angular_velocity = to_vector(in.angular_velocity());
  out.surface = to_surface(in.surface());
}

/// As many vertices as the mesh has, counted before they are made.
Status read_start_positions(const google::protobuf::RepeatedField<double>& in, const physics::Mesh& mesh,
                            std::vector<Vec3d>& out) {
  const auto count = static_cast<std::size_t>(in.size());
  const std::size_t wanted = 3 * mesh.positions_m.size();
  if (count != 0 && count != wanted) {
    return base::invalid("are " + std::to_string(count) + " numbers; a mesh of " +
                         std::to_string(mesh.positions_m.size()) + " vertices has " + std::to_string(wanted));
  }
  out.reserve(count / 3);
  for (int i = 0; i < in.size(); i += 3) out.emplace_back(in[i], in[i + 1], in[i + 2]);
  return {};
}

Status read_vertex_masses(const google::protobuf::RepeatedField<double>& in, const physics::Mesh& mesh,
                          std::vector<double>& out) {
  const auto count = static_cast<std::size_t>(in.size());
  if (count != 0 && count != mesh.positions_m.size()) {
    return base::invalid("are " + std::to_string(count) + " factors; a mesh of " +
                         std::to_string(mesh.positions_m.size()) + " vertices has one for each");
  }
  out.assign(in.begin(), in.end());
  return {};
}

Status read_soft_body(const v1::SoftBody& in, const MeshLibrary& meshes, physics::SoftBody& out) {
  Failures failures;
  const auto mesh = meshes.find(in.mesh());
  failures.note("mesh", mesh.status());
  if (mesh.ok()) {
    out.mesh = *mesh;
    failures.note("start_positions", read_start_positions(in.start_positions(), **mesh, out.start_positions_m));
    failures.note("vertex_mass_scale", read_vertex_masses(in.vertex_mass_scale(), **mesh, out.vertex_mass_scale));
  }
  read_motion(in, out, failures);
  if (in.has_mass_kg()) out.mass_kg = in.mass_kg();
  read_springs(in.springs(), out.springs);
  if (in.has_gas()) failures.note("gas", read_gas(in.gas(), out.gas.emplace()));
  failures.note("volume", read_volume(in.volume(), out.volume));
  using physics::PressureSpread;
  failures.note("pressure_spread",
                read_enum(in.pressure_spread(),
                          {{v1::FACES, PressureSpread::faces}, {v1::VERTEX_NORMALS, PressureSpread::vertex_normals}},
                          out.pressure_spread));
  out.pins.assign(in.pins().begin(), in.pins().end());
  out.pin_boundary = in.pin_boundary();
  out.drag = {in.drag().normal(), in.drag().tangential()};
  failures.note("collision", read_collision(in.collision(), out.collision));
  return failures.first();
}

std::array<bool, 3> to_axes(const v1::LockedAxes::Axes& in) {
  return {in.x(), in.y(), in.z()};
}

/// A mesh is filled: it must be closed and convex.
Status read_rigid_shape(const v1::RigidBody& in, const MeshLibrary& meshes, physics::Shape& out) {
  if (!in.shape().has_mesh()) return read_shape(in.shape(), meshes, out);
  const std::string& name = in.shape().mesh();
  auto mesh = meshes.find(name);
  if (!mesh.ok()) return mesh.status().inside("mesh");
  auto solid = physics::make_polyhedron(**mesh);
  if (!solid.ok()) {
    const Status& status = solid.status();
    return {status.code(), "mesh \"" + name + "\" of rigid body \"" + in.name() + "\" " + status.what(), "mesh"};
  }
  out = physics::ConvexShape{name, std::move(*mesh), std::move(*solid)};
  return {};
}

Status read_rigid_body(const v1::RigidBody& in, const MeshLibrary& meshes, physics::RigidBody& out) {
  Failures failures;
  failures.note("shape", read_rigid_shape(in, meshes, out.shape));
  read_motion(in, out, failures);
  if (in.has_mass_kg()) out.mass_kg = in.mass_kg();
  out.locked = {to_axes(in.locked().translation()), to_axes(in.locked().rotation())};
  return failures.first();
}

Status read_collider(const v1::Collider& in, const MeshLibrary& meshes, physics::Collider& out) {
  Failures failures;
  failures.note("shape", read_shape(in.shape(), meshes, out.shape));
  read_motion(in, out, failures);
  return failures.first();
}

void read_anchor(const v1::Anchor& in, physics::Anchor& out) {
  using Of = physics::Anchor::Of;
  switch (in.body_case()) {
    case v1::Anchor::kSoftBody:
      out.of = Of::soft;
      out.body = in.soft_body();
      break;
    case v1::Anchor::kRigidBody:
      out.of = Of::rigid;
      out.body = in.rigid_body();
      break;
    case v1::Anchor::kCollider:
      out.of = Of::collider;
      out.body = in.collider();
      break;
    case v1::Anchor::BODY_NOT_SET:
      break;
  }
  if (in.has_vertex()) out.vertex = in.vertex();
  if (in.has_face_point()) {
    out.face = in.face_point().face();
    out.face_weights = to_vector(in.face_point().weights());
  }
  if (in.has_point()) out.point_m = to_vector(in.point());
}

Status read_joint(const v1::Joint& in, physics::Joint& out) {
  Failures failures;
  out.name = in.name();
  read_anchor(in.first(), out.first);
  read_anchor(in.second(), out.second);
  const auto read_axis = [](const v1::Vec3& axis, Vec3d& direction) {
    return normalise<Vec3d>(to_vector(axis), Vec3d::UnitY(), direction);
  };
  switch (in.kind_case()) {
    case v1::Joint::kDistanceLimit:
      out.kind = physics::DistanceLimit{in.distance_limit().longest_m()};
      break;
    case v1::Joint::kHinge:
      failures.note("hinge.axis", read_axis(in.hinge().axis(), out.kind.emplace<physics::HingeJoint>().axis));
      break;
    case v1::Joint::kSlider:
      failures.note("slider.axis", read_axis(in.slider().axis(), out.kind.emplace<physics::SliderJoint>().axis));
      break;
    case v1::Joint::kPoint:
    case v1::Joint::KIND_NOT_SET:
      break;
  }
  out.compliance_m_n = in.compliance_m_n();
  if (in.has_break_force_n()) {
    // Infinity is how the engine says that a joint does not break.
    if (!std::isfinite(in.break_force_n())) failures.note("break_force_n", base::invalid("is not finite"));
    out.break_force_n = in.break_force_n();
  }
  return failures.first();
}

/// Each item of a list by `read`, as many as the engine admits: where there are more, check_scene would say so, but
/// only after all of them were made.
template <class In, class Out, class Read>
Status read_list(const In& in, const char* field, std::size_t limit, std::vector<Out>& out, Read read) {
  if (static_cast<std::size_t>(in.size()) > limit) {
    return {StatusCode::limit_exceeded, "are " + std::to_string(in.size()) + "; at most " + std::to_string(limit),
            field};
  }
  out.resize(static_cast<std::size_t>(in.size()));
  for (int i = 0; i < in.size(); ++i) {
    const Status status = read(in[i], out[static_cast<std::size_t>(i)]);
    if (!status.ok()) return status.inside(std::string(field) + "[" + std::to_string(i) + "]");
  }
  return {};
}

}  // namespace

Result<physics::Scene> to_physics(const v1::Scene& scene) {
  const auto meshes = MeshLibrary::build(scene);
  if (!meshes.ok()) return meshes.status();
  return to_physics(scene, *meshes);
}

Result<physics::Scene> to_physics(const v1::Scene& scene, const MeshLibrary& meshes) {
  physics::Scene out;
  out.name = scene.name();
  out.gravity = to_vector(scene.gravity());
  if (auto status = read_stepping(scene.stepping(), out.stepping); !status.ok()) return status.inside("stepping");
  out.atmosphere.pressure_pa = scene.atmosphere().pressure_pa();
  out.atmosphere.density_kg_m3 = scene.atmosphere().density_kg_m3();
  out.atmosphere.wind = to_vector(scene.atmosphere().wind());

  Status status = read_list(scene.soft_bodies(), "soft_bodies", base::world_bodies_max, out.soft_bodies,
                            [&meshes](const auto& in, auto& body) { return read_soft_body(in, meshes, body); });
  if (!status.ok()) return status;
  status = read_list(scene.rigid_bodies(), "rigid_bodies", base::world_bodies_max, out.rigid_bodies,
                     [&meshes](const auto& in, auto& body) { return read_rigid_body(in, meshes, body); });
  if (!status.ok()) return status;
  status = read_list(scene.colliders(), "colliders", base::world_colliders_max, out.colliders,
                     [&meshes](const auto& in, auto& body) { return read_collider(in, meshes, body); });
  if (!status.ok()) return status;
  status = read_list(scene.joints(), "joints", base::world_joints_max, out.joints, read_joint);
  if (!status.ok()) return status;
  if (auto checked = physics::check_scene(out); !checked.ok()) return checked;
  return out;
}

}  // namespace pneuma::scene_io
