#include "app/frame_source.h"

#include "app/mechanics.h"
#include "scene_io/translate.h"

namespace pneuma::app {

namespace {

void add_solid(v1::Layout& layout, const std::string& name, const physics::Shape& shape, bool dynamic) {
  v1::Layout::Solid& solid = *layout.add_solids();
  solid.set_name(name);
  *solid.mutable_shape() = scene_io::to_proto(shape);
  solid.set_dynamic(dynamic);
  const auto* named = std::get_if<physics::MeshShape>(&shape);
  if (named == nullptr) return;
  v1::Mesh::Triangles& surface = *solid.mutable_surface();
  for (const Eigen::Vector3d& p : named->mesh->positions_m) {
    v1::Vec3& position = *surface.add_positions();
    position.set_x(p.x());
    position.set_y(p.y());
    position.set_z(p.z());
  }
  for (const physics::Face& face : named->mesh->faces) surface.mutable_indices()->Add(face.begin(), face.end());
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
  using Other = physics::VertexContact::Other;
  std::vector<TouchedVertex> touched;
  for (const physics::VertexContact& contact : world_.contacts(index)) {
    const std::size_t before = contact.other == Other::collider ? world_.rigid_bodies().size() : 0;
    touched.push_back({contact.vertex, contact.other == Other::soft, before + contact.index, contact.normal});
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

}  // namespace pneuma::app
