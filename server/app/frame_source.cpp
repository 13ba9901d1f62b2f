#include "app/frame_source.h"

#include "app/mechanics.h"
#include "physics/mesh/polyhedron.h"
#include "scene_io/translate.h"
#include "scene_io/vectors.h"

namespace pneuma::app {

namespace {

/// In a frame that begins at `origin_m` of the mesh's.
v1::Mesh::Triangles triangles_of(const physics::Mesh& mesh, const physics::Vec3d& origin_m) {
  v1::Mesh::Triangles out;
  for (const Eigen::Vector3d& in_mesh : mesh.positions_m) {
    scene_io::set(*out.add_positions(), in_mesh - origin_m);
  }
  for (const physics::Face& face : mesh.faces) out.mutable_indices()->Add(face.begin(), face.end());
  return out;
}

void add_solid(v1::Layout& layout, const std::string& name, const physics::Shape& shape, bool dynamic) {
  v1::Layout::Solid& solid = *layout.add_solids();
  solid.set_name(name);
  *solid.mutable_shape() = scene_io::to_proto(shape);
  solid.set_dynamic(dynamic);
  if (const auto* named = std::get_if<physics::MeshShape>(&shape)) {
    *solid.mutable_surface() = triangles_of(*named->mesh, physics::Vec3d::Zero());
  } else if (const auto* convex = std::get_if<physics::ConvexShape>(&shape)) {
    *solid.mutable_surface() = triangles_of(*convex->mesh, convex->solid->centre_m);
  }
}

void describe_end(const physics::JointState& joint, std::size_t which, std::size_t rigid_count,
                  v1::Layout::Joint::End& out) {
  using Of = physics::Anchor::Of;
  const physics::JointEnd& end = joint.ends[which];
  if (end.of == Of::soft) {
    out.set_soft(end.index);
    for (std::uint32_t i = 0; i < end.support.count; ++i) {
      out.add_vertices(end.support.vertices[i]);
      out.add_weights(end.support.weights[i]);
    }
    return;
  }
  const std::size_t before = end.of == Of::collider ? rigid_count : 0;
  if (end.of != Of::world) out.set_solid(static_cast<std::uint32_t>(before + end.index));
  scene_io::set(*out.mutable_point(), joint.points_m[which]);
}

}  // namespace

BodyScalars LiveFrames::scalars(std::size_t index) const {
  const physics::BodyMeasures measures = world_.measure(index);
  return {.volume_m3 = measures.volume_m3,
          .pressure_pa = measures.pressure_pa,
          .kinetic_j = measures.kinetic_j,
          .elastic_j = measures.elastic_j,
          .asleep = world_.is_asleep(index)};
}

std::vector<TouchedVertex> LiveFrames::contacts(std::size_t index) const {
  std::vector<TouchedVertex> touched;
  for (const physics::VertexContact& contact : world_.contacts(index)) {
    const auto [kind, other] = contact.other;
    const std::size_t before = kind == physics::BodyKind::collider ? world_.rigid_bodies().size() : 0;
    touched.push_back({contact.vertex, kind == physics::BodyKind::soft, before + other, contact.normal});
  }
  return touched;
}

std::optional<codec::Mechanics> LiveFrames::mechanics(std::size_t index, const codec::MeshOrder& order,
                                                      MechanicsTerms& terms) const {
  return mechanics_of(world_, index, order, terms);
}

void LiveFrames::describe_solids(v1::Layout& layout) const {
  for (const auto& rigid : world_.rigid_bodies()) add_solid(layout, rigid.body.name, rigid.body.shape, true);
  for (const auto& collider : world_.colliders()) {
    add_solid(layout, collider.collider.name, collider.collider.shape, false);
  }
}

std::vector<physics::Pose> LiveFrames::poses() const {
  std::vector<physics::Pose> poses;
  poses.reserve(world_.rigid_bodies().size() + world_.colliders().size());
  for (const auto& rigid : world_.rigid_bodies()) poses.push_back({rigid.position, rigid.orientation});
  for (const auto& collider : world_.colliders()) poses.push_back({collider.position, collider.orientation});
  return poses;
}

void LiveFrames::describe_joints(v1::Layout& layout) const {
  for (const physics::JointState& joint : world_.joints()) {
    v1::Layout::Joint& out = *layout.add_joints();
    out.set_name(joint.joint.name);
    describe_end(joint, 0, world_.rigid_bodies().size(), *out.mutable_first());
    describe_end(joint, 1, world_.rigid_bodies().size(), *out.mutable_second());
    out.set_rope(std::holds_alternative<physics::DistanceLimit>(joint.joint.kind));
  }
}

}  // namespace pneuma::app
