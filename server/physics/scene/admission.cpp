#include "physics/scene/admission.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "base/hidden_text.h"
#include "base/limits.h"
#include "base/number_text.h"
#include "physics/scene/shape_parts.h"

namespace pneuma::physics {
namespace {

using base::number_text;

// What normalising in double leaves is near 1e-16; a scene built in single precision is off by 1e-7.
constexpr double unit_length_tolerance = 1e-6;

/// Checks the fields of one message; the first failure of all of them is kept.
class Fields {
 public:
  Fields(base::Status& first, std::string path) : first_(first), path_(std::move(path)) {}

  [[nodiscard]] Fields in(std::string_view field) const { return {first_, path(field)}; }

  void fail(std::string_view field, std::string what, base::StatusCode code = base::StatusCode::invalid_argument) {
    if (first_.ok()) first_ = {code, std::move(what), path(field)};
  }
  void fail(const base::Status& status) {
    if (first_.ok()) first_ = path_.empty() ? status : status.inside(path_);
  }

  /// Finite and of at most this magnitude.
  bool finite(std::string_view field, double value, double magnitude_max) {
    if (!std::isfinite(value)) {
      fail(field, "is not finite");
    } else if (std::abs(value) > magnitude_max) {
      fail(field, "is " + number_text(value) + "; its magnitude may be at most " + number_text(magnitude_max),
           base::StatusCode::limit_exceeded);
    } else {
      return true;
    }
    return false;
  }
  void positive(std::string_view field, double value, double max = base::scene_number_max) {
    if (finite(field, value, max)) more_than(field, value, 0.0);
  }
  void not_negative(std::string_view field, double value, double max = base::scene_number_max) {
    if (finite(field, value, max) && value < 0.0) fail(field, "is " + number_text(value) + "; must not be negative");
  }
  void more_than(std::string_view field, double value, double low) {
    if (value <= low) fail(field, "is " + number_text(value) + "; must be greater than " + number_text(low));
  }
  /// Greater than 0, and not so little that it counts as nothing.
  void at_least(std::string_view field, double value, double min, double max) {
    positive(field, value, max);
    if (value < min) {
      fail(field, "is " + number_text(value) + "; must be at least " + number_text(min),
           base::StatusCode::limit_exceeded);
    }
  }
  void between(std::string_view field, double value, double low, double high) {
    if (!std::isfinite(value)) fail(field, "is not finite");
    if (value < low || value > high) {
      fail(field, "is " + number_text(value) + "; must be from " + number_text(low) + " to " + number_text(high));
    }
  }
  void extent_m(std::string_view field, double value) {
    at_least(field, value, base::extent_min_m, base::coordinate_max_m);
  }
  void mass_kg(double value) { at_least("mass_kg", value, base::mass_min_kg, base::scene_number_max); }

  void vector(std::string_view field, const Vec3d& value, double magnitude_max) {
    Fields components = in(field);
    for (int axis = 0; axis < 3; ++axis) components.finite(axis_name(axis), value[axis], magnitude_max);
  }
  void extents_m(std::string_view field, const Vec3d& value) {
    Fields components = in(field);
    for (int axis = 0; axis < 3; ++axis) components.extent_m(axis_name(axis), value[axis]);
  }
  void direction(std::string_view field, const Vec3d& value) {
    vector(field, value, base::scene_number_max);
    if (std::abs(value.norm() - 1.0) > unit_length_tolerance) fail(field, "has no direction: its length must be 1");
  }
  void rotation(std::string_view field, const Quatd& value) {
    Fields components = in(field);
    components.finite("w", value.w(), base::scene_number_max);
    components.vector("", value.vec(), base::scene_number_max);
    if (std::abs(value.norm() - 1.0) > unit_length_tolerance) fail(field, "is no rotation: its length must be 1");
  }

 private:
  static std::string_view axis_name(int axis) {
    constexpr std::array<std::string_view, 3> names{"x", "y", "z"};
    return names[static_cast<std::size_t>(axis)];
  }
  [[nodiscard]] std::string path(std::string_view field) const {
    if (path_.empty() || field.empty()) return path_ + std::string(field);
    return path_ + "." + std::string(field);
  }

  base::Status& first_;
  std::string path_;
};

std::string item(std::string_view list, std::size_t index) {
  return std::string(list) + "[" + std::to_string(index) + "]";
}

/// Distance of the furthest vertex from the body's own origin, at the start.
double reach_m(const SoftBody& body) {
  double squared = 0.0;
  for (const Vec3d& position : body.start_shape_m()) squared = std::max(squared, position.squaredNorm());
  return std::sqrt(squared);
}

/// Of the longer of the shapes that the body has and begins in.
double start_length_m(const SoftBody& body) {
  return std::max(diagonal_m(body.mesh->positions_m), diagonal_m(body.start_shape_m()));
}

void check_counts(const Scene& scene, Fields fields) {
  const auto at_most = [&](std::string_view field, std::size_t count, std::size_t max, std::string_view of) {
    if (count > max) {
      fields.fail(field, "makes " + std::to_string(count) + " " + std::string(of) + "; at most " + std::to_string(max),
                  base::StatusCode::limit_exceeded);
    }
  };
  at_most("soft_bodies", scene.soft_bodies.size(), base::world_bodies_max, "bodies");
  at_most("rigid_bodies", scene.soft_bodies.size() + scene.rigid_bodies.size(), base::world_bodies_max, "bodies");
  at_most("colliders", scene.colliders.size(), base::world_colliders_max, "colliders");
  at_most("joints", scene.joints.size(), base::world_joints_max, "joints");
  std::size_t vertex_count = 0;
  for (const SoftBody& body : scene.soft_bodies) vertex_count += body.mesh ? body.mesh->positions_m.size() : 0;
  at_most("soft_bodies", vertex_count, base::world_vertices_max, "vertices");
  std::size_t mesh_vertices = 0;
  for (const Collider& collider : scene.colliders) {
    const auto* shape = std::get_if<MeshShape>(&collider.shape);
    if (shape != nullptr && shape->mesh) mesh_vertices += shape->mesh->positions_m.size();
  }
  at_most("colliders", mesh_vertices, base::collider_mesh_vertices_max, "vertices of meshes");
}

/// Requests address bodies and colliders by name alone, so all of them share one set of names.
class Names {
 public:
  void check(const std::string& name, const std::string& path, Fields fields) {
    if (name.empty()) fields.fail("name", "is empty");
    check_text(name, fields);
    const auto [entry, is_new] = owners_.try_emplace(name, path);
    if (!is_new) fields.fail("name", "'" + name + "' is already the name of " + entry->second);
  }
  static void check_text(const std::string& name, Fields fields) {
    if (name.size() > base::name_bytes_max) {
      fields.fail("name",
                  "has " + std::to_string(name.size()) + " bytes; at most " + std::to_string(base::name_bytes_max),
                  base::StatusCode::limit_exceeded);
    }
    if (base::has_hidden(name)) fields.fail("name", "has a control character, or one that does not show");
  }

 private:
  std::unordered_map<std::string, std::string> owners_;
};

void check_stepping(const Stepping& stepping, Fields fields) {
  fields.at_least("rate_hz", stepping.rate_hz, base::rate_hz_min, base::rate_hz_max);
  if (stepping.substeps > base::substeps_max) {
    fields.fail("substeps",
                "is " + std::to_string(stepping.substeps) + "; at most " + std::to_string(base::substeps_max),
                base::StatusCode::limit_exceeded);
  }
  fields.more_than("error_target", stepping.error_target, 0.0);
  fields.between("error_target", stepping.error_target, 0.0, 0.5);
  fields.between("newton_iterations", stepping.newton_iterations, 1.0, base::newton_iterations_max);
}

void check_atmosphere(const Atmosphere& atmosphere, Fields fields) {
  fields.not_negative("pressure_pa", atmosphere.pressure_pa);
  fields.not_negative("density_kg_m3", atmosphere.density_kg_m3);
  fields.vector("wind", atmosphere.wind, base::speed_max_m_s);
}

void check_surface(const Surface& surface, Fields fields) {
  if (surface.restitution) fields.between("restitution", *surface.restitution, 0.0, 1.0);
  if (surface.friction) fields.not_negative("friction", *surface.friction, base::coefficient_max);
  fields.not_negative("thickness_m", surface.thickness_m, base::coordinate_max_m);
}

/// What soft bodies, rigid bodies and colliders have alike.
template <class Body>
void check_motion(const Body& body, Fields fields) {
  fields.vector("position", body.position, base::coordinate_max_m);
  fields.rotation("orientation", body.orientation);
  fields.vector("velocity", body.velocity, base::speed_max_m_s);
  fields.vector("angular_velocity", body.angular_velocity, base::speed_max_m_s);
}

void check_shape(const Shape& shape, Fields fields) {
  struct Checker {
    Fields& fields;
    void operator()(const PlaneShape& plane) const { fields.in("plane").direction("normal", plane.normal); }
    void operator()(const SphereShape& sphere) const { fields.in("sphere").extent_m("radius_m", sphere.radius_m); }
    void operator()(const BoxShape& box) const { fields.in("box").extents_m("half_extents", box.half_extents_m); }
    void operator()(const EllipsoidShape& ellipsoid) const {
      fields.in("ellipsoid").extents_m("radii", ellipsoid.radii_m);
    }
    void operator()(const CapsuleShape& capsule) const {
      fields.in("capsule").extent_m("radius_m", capsule.radius_m);
      fields.in("capsule").not_negative("half_height_m", capsule.half_height_m, base::coordinate_max_m);
    }
    void operator()(const RoomShape& room) const { fields.in("room").extents_m("half_extents", room.half_extents_m); }
    void operator()(const MeshShape& shape) const {
      if (shape.mesh == nullptr) fields.fail("mesh", "is missing");
    }
    void operator()(const ConvexShape& convex) const {
      if (convex.solid == nullptr) {
        fields.fail("mesh", "is missing");
      } else if (convex.solid->half_width_m < base::extent_min_m) {
        fields.fail("mesh",
                    "is " + number_text(2.0 * convex.solid->half_width_m) + " m thin; must be at least " +
                        number_text(2.0 * base::extent_min_m),
                    base::StatusCode::limit_exceeded);
      }
    }
  };
  std::visit(Checker{fields}, shape);
}

void check_gas(const Gas& gas, const Mesh& mesh, Fields body_fields) {
  Fields fields = body_fields.in("gas");
  fields.not_negative("moles", gas.moles);
  fields.positive("temperature_k", gas.temperature_k);
  fields.positive("heat_capacity_ratio", gas.heat_capacity_ratio, base::heat_capacity_ratio_max);
  fields.more_than("heat_capacity_ratio", gas.heat_capacity_ratio, 1.0);
  fields.finite("flow_mol_s", gas.flow_mol_s, base::scene_number_max);
  fields.not_negative("leak_mol_s_pa", gas.leak_mol_s_pa);
  if (gas.burst_pressure_pa) fields.positive("burst_pressure_pa", *gas.burst_pressure_pa);
  if (const base::Status status = check_holds_gas(mesh); !status.ok()) body_fields.fail(status);
}

void check_volume(const Volume& volume, Fields fields) {
  const auto within = [&](std::uint32_t max) { fields.at_least("resolution", volume.resolution, 1.0, max); };
  if (volume.method == VolumeMethod::subdivided) {
    within(base::volume_subdivisions_max);
  } else if (volume.method == VolumeMethod::monte_carlo) {
    within(base::volume_samples_max);
  } else if (volume.resolution != 0) {
    fields.fail("resolution",
                "is " + std::to_string(volume.resolution) + "; only the methods SUBDIVIDED and MONTE_CARLO have one");
  }
}

void check_pins(const SoftBody& body, Fields fields) {
  const std::size_t vertex_count = body.mesh->positions_m.size();
  for (std::size_t i = 0; i < body.pins.size(); ++i) {
    if (body.pins[i] < vertex_count) continue;
    fields.fail(item("pins", i), "names vertex " + std::to_string(body.pins[i]) + " of a mesh of " +
                                     std::to_string(vertex_count) + " vertices");
  }
  if (body.pin_boundary && body.mesh->closed) fields.fail("pin_boundary", "the mesh is closed and has no border");
}

/// One for each of the mesh's vertices, or none.
void check_stiffness_scale(const SoftBody& body, Fields springs) {
  const std::vector<double>& scale = body.springs.vertex_stiffness_scale;
  const std::size_t vertex_count = body.mesh->positions_m.size();
  if (!scale.empty() && scale.size() != vertex_count) {
    springs.fail("vertex_stiffness_scale", "has " + std::to_string(scale.size()) + " factors for a mesh of " +
                                               std::to_string(vertex_count) + " vertices");
  }
  for (std::size_t i = 0; i < scale.size(); ++i) {
    if (scale[i] >= 0.0 && scale[i] <= base::scene_number_max) continue;
    springs.not_negative(item("vertex_stiffness_scale", i), scale[i]);
    return;
  }
}

/// One for each of the mesh's vertices, or none.
void check_start_positions(const SoftBody& body, Fields fields) {
  const std::size_t vertex_count = body.mesh->positions_m.size();
  const std::size_t count = body.start_positions_m.size();
  if (count != 0 && count != vertex_count) {
    fields.fail("start_positions",
                "place " + std::to_string(count) + " vertices of a mesh of " + std::to_string(vertex_count));
  }
  for (std::size_t i = 0; i < 3 * count; ++i) {
    const double coordinate_m = body.start_positions_m[i / 3][static_cast<Eigen::Index>(i % 3)];
    if (std::abs(coordinate_m) <= base::coordinate_max_m) continue;
    fields.finite(item("start_positions", i), coordinate_m, base::coordinate_max_m);
    return;
  }
}

/// One for each of the mesh's vertices, or none.
void check_vertex_masses(const SoftBody& body, Fields fields) {
  constexpr std::string_view field = "vertex_mass_scale";
  const std::vector<double>& scales = body.vertex_mass_scale;
  if (scales.empty()) return;
  if (scales.size() != body.mesh->positions_m.size()) {
    fields.fail(field, "has " + std::to_string(scales.size()) + " factors for a mesh of " +
                           std::to_string(body.mesh->positions_m.size()) + " vertices");
  }
  const auto is_mass = [](double scale) { return scale > 0.0 && scale <= base::scene_number_max; };
  const auto wrong = std::ranges::find_if_not(scales, is_mass);
  if (wrong != scales.end()) {
    fields.positive(item(field, static_cast<std::size_t>(wrong - scales.begin())), *wrong);
    return;
  }
  const auto least = std::ranges::min_element(scales);
  const auto most = std::ranges::max_element(scales);
  if (*most / *least <= base::vertex_mass_ratio_max) return;
  fields.fail(item(field, static_cast<std::size_t>(most - scales.begin())),
              "is " + number_text(*most / *least) + " times " +
                  item(field, static_cast<std::size_t>(least - scales.begin())) + "; at most " +
                  number_text(base::vertex_mass_ratio_max) + " times",
              base::StatusCode::limit_exceeded);
}

/// No vertex may start past the limits at which a body counts as run away.
void check_start_of_vertices(const SoftBody& body, Fields fields) {
  const double reach = reach_m(body);
  if (body.position.cwiseAbs().maxCoeff() + reach > base::coordinate_max_m) {
    fields.fail("position", "puts a vertex further than " + number_text(base::coordinate_max_m) + " m from the origin",
                base::StatusCode::limit_exceeded);
  }
  if (body.velocity.norm() + body.angular_velocity.norm() * reach > base::speed_max_m_s) {
    const bool turns = body.angular_velocity.norm() * reach > body.velocity.norm();
    fields.fail(turns ? "angular_velocity" : "velocity",
                "makes a vertex faster than " + number_text(base::speed_max_m_s) + " m/s",
                base::StatusCode::limit_exceeded);
  }
}

/// Edges that the numbers of the scene can tell from nothing.
void check_edges(const SoftBody& body, Precision precision, Fields fields) {
  const std::vector<double>& lengths_m = body.mesh->edge_lengths_m;
  const double shortest_m = *std::min_element(lengths_m.begin(), lengths_m.end());
  if (shortest_m < base::extent_min_m) {
    fields.fail("mesh", "has an edge of " + number_text(shortest_m) + " m; at least " + number_text(base::extent_min_m),
                base::StatusCode::limit_exceeded);
  }
  if (precision == Precision::double_precision) return;
  const double length_m = start_length_m(body);
  if (length_m > base::single_precision_edges_max * shortest_m) {
    fields.fail("mesh",
                "has an edge of " + number_text(shortest_m) + " m on a body " + number_text(length_m) +
                    " m long, more than " + number_text(base::single_precision_edges_max) +
                    " times that; precision SINGLE does not hold there, DOUBLE does",
                base::StatusCode::limit_exceeded);
  }
}

void check_soft_body(const SoftBody& body, Precision precision, Fields fields) {
  if (body.mesh == nullptr) {
    fields.fail("mesh", "is missing");
    return;
  }
  check_motion(body, fields);
  check_start_positions(body, fields);
  check_start_of_vertices(body, fields);
  check_edges(body, precision, fields);
  fields.mass_kg(body.mass_kg);
  check_vertex_masses(body, fields);
  Fields springs = fields.in("springs");
  springs.not_negative("stiffness_n_m", body.springs.stiffness_n_m, base::stiffness_max_n_m);
  springs.not_negative("damping_n_s_m", body.springs.damping_n_s_m, base::damping_max_n_s_m);
  springs.not_negative("bend_stiffness_n_m", body.springs.bend_stiffness_n_m, base::stiffness_max_n_m);
  springs.positive("rest_scale", body.springs.rest_scale, base::rest_scale_max);
  check_stiffness_scale(body, springs);
  if (body.gas) check_gas(*body.gas, *body.mesh, fields);
  check_volume(body.volume, fields.in("volume"));
  check_surface(body.surface, fields.in("surface"));
  check_pins(body, fields);
  fields.in("drag").not_negative("normal", body.drag.normal, base::coefficient_max);
  fields.in("drag").not_negative("tangential", body.drag.tangential, base::coefficient_max);
}

void check_rigid_body(const RigidBody& body, Fields fields) {
  if (!may_be_rigid(body.shape)) {
    fields.fail("shape", "a rigid body is a sphere, a box, a capsule or a convex mesh");
  }
  check_shape(body.shape, fields.in("shape"));
  fields.mass_kg(body.mass_kg);
  check_motion(body, fields);
  check_surface(body.surface, fields.in("surface"));
}

void check_collider(const Collider& collider, const Fields& fields) {
  check_shape(collider.shape, fields.in("shape"));
  check_motion(collider, fields);
  check_surface(collider.surface, fields.in("surface"));
}

template <class Body>
const Body* named(const std::vector<Body>& bodies, const std::string& name) {
  const auto found = std::ranges::find(bodies, name, &Body::name);
  return found == bodies.end() ? nullptr : &*found;
}

void check_soft_anchor(const Anchor& anchor, const SoftBody& body, Fields fields) {
  const Mesh& mesh = *body.mesh;
  const auto in_range = [&](std::string_view field, std::uint32_t index, std::size_t count, std::string_view of) {
    if (index < count) return;
    fields.fail(field, "is " + std::to_string(index) + "; \"" + body.name + "\" has " + std::to_string(count) + " " +
                           std::string(of));
  };
  if (anchor.point_m) fields.fail("point", "a soft body is held by a vertex or a face_point");
  if (anchor.vertex.has_value() == anchor.face.has_value()) {
    fields.fail("at", "a soft body is held by a vertex or a face_point");
  }
  if (anchor.vertex) in_range("vertex", *anchor.vertex, mesh.positions_m.size(), "vertices");
  if (!anchor.face) return;
  in_range("face_point.face", *anchor.face, mesh.faces.size(), "faces");
  const Vec3d& weights = anchor.face_weights;
  Fields of_face = fields.in("face_point");
  of_face.vector("weights", weights, 1.0);
  if (std::abs(weights.sum() - 1.0) > unit_length_tolerance || weights.minCoeff() < 0.0) {
    of_face.fail("weights", "add up to " + number_text(weights.sum()) + "; must be 0 or more and add up to 1");
  }
}

void check_anchor(const Anchor& anchor, const Scene& scene, Fields fields) {
  const auto unknown = [&](std::string_view field, std::string_view kind) {
    fields.fail(field, "no " + std::string(kind) + " is named \"" + anchor.body + "\"", base::StatusCode::not_found);
  };
  if (anchor.of == Anchor::Of::soft) {
    const SoftBody* body = named(scene.soft_bodies, anchor.body);
    if (body == nullptr) return unknown("soft_body", "soft body");
    if (body->mesh != nullptr) check_soft_anchor(anchor, *body, fields);
    return;
  }
  if (anchor.of == Anchor::Of::rigid && named(scene.rigid_bodies, anchor.body) == nullptr) {
    return unknown("rigid_body", "rigid body");
  }
  if (anchor.of == Anchor::Of::collider && named(scene.colliders, anchor.body) == nullptr) {
    return unknown("collider", "collider");
  }
  if (anchor.vertex || anchor.face) fields.fail("at", "only a soft body has vertices and faces");
  if (anchor.point_m) fields.vector("point", *anchor.point_m, base::coordinate_max_m);
}

void check_joint(const Joint& joint, const Scene& scene, Fields fields) {
  check_anchor(joint.first, scene, fields.in("first"));
  check_anchor(joint.second, scene, fields.in("second"));
  const auto is_fixed = [](const Anchor& anchor) {
    return anchor.of == Anchor::Of::world || anchor.of == Anchor::Of::collider;
  };
  if (is_fixed(joint.first) && is_fixed(joint.second)) {
    fields.fail("first", "and second are both fixed: a joint holds a soft or a rigid body");
  }
  const bool same_body = joint.first.of == joint.second.of && joint.first.body == joint.second.body;
  const bool same_point = joint.first.vertex == joint.second.vertex && joint.first.face == joint.second.face &&
                          joint.first.face_weights == joint.second.face_weights;
  if (same_body && (joint.first.of != Anchor::Of::soft || same_point)) {
    fields.fail("second",
                "is on the same " + std::string(joint.first.of == Anchor::Of::soft ? "point" : "body") + " as first");
  }
  const auto check_axis = [&](std::string_view field, const Vec3d& axis) {
    fields.in(field).direction("axis", axis);
    for (const auto& [anchor, end] : {std::pair(&joint.first, "first"), std::pair(&joint.second, "second")}) {
      if (anchor->of != Anchor::Of::soft) continue;
      fields.fail(field, "holds rigid bodies alone; " + std::string(end) + " is on soft body \"" + anchor->body + "\"");
    }
  };
  if (const auto* limit = std::get_if<DistanceLimit>(&joint.kind)) {
    fields.in("distance_limit").extent_m("longest_m", limit->longest_m);
  }
  if (const auto* hinge = std::get_if<HingeJoint>(&joint.kind)) check_axis("hinge", hinge->axis);
  if (const auto* slider = std::get_if<SliderJoint>(&joint.kind)) check_axis("slider", slider->axis);
  fields.not_negative("compliance_m_n", joint.compliance_m_n, base::scene_number_max);
  if (joint.break_force_n != std::numeric_limits<double>::infinity()) {
    fields.positive("break_force_n", joint.break_force_n);
  }
}

}  // namespace

base::Status check_scene(const Scene& scene) {
  base::Status first;
  Fields fields(first, "");
  Names names;
  const auto check_list = [&](std::string_view list, const auto& bodies, const auto& check) {
    for (std::size_t i = 0; i < bodies.size() && first.ok(); ++i) {
      const std::string path = item(list, i);
      names.check(bodies[i].name, path, fields.in(path));
      check(bodies[i], fields.in(path));
    }
  };
  check_counts(scene, fields);
  Names::check_text(scene.name, fields);
  fields.vector("gravity", scene.gravity, base::acceleration_max_m_s2);
  check_stepping(scene.stepping, fields.in("stepping"));
  check_atmosphere(scene.atmosphere, fields.in("atmosphere"));
  check_list("soft_bodies", scene.soft_bodies, [&scene](const SoftBody& body, const Fields& of_body) {
    check_soft_body(body, scene.stepping.precision, of_body);
  });
  check_list("rigid_bodies", scene.rigid_bodies, check_rigid_body);
  check_list("colliders", scene.colliders, check_collider);
  names = {};  // joints have names of their own
  check_list("joints", scene.joints,
             [&scene](const Joint& joint, const Fields& of_joint) { check_joint(joint, scene, of_joint); });
  return first;
}

}  // namespace pneuma::physics
