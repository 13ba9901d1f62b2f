#include "replay/recorded_frames.h"

#include <algorithm>
#include <span>
#include <utility>

namespace pneuma::replay {

namespace {

/// Its faces, and where the vertices are now; a recording does not know where they were at rest.
std::shared_ptr<const physics::Mesh> mesh_of(const client::SoftBodyFrame& body) {
  const client::Topology& topology = *body.topology;
  auto mesh = std::make_shared<physics::Mesh>();
  mesh->positions_m.reserve(topology.vertex_count);
  for (std::size_t i = 0; i + 2 < body.positions_m.size(); i += 3) {
    mesh->positions_m.emplace_back(body.positions_m[i], body.positions_m[i + 1], body.positions_m[i + 2]);
  }
  mesh->faces.reserve(topology.indices.size() / 3);
  for (std::size_t i = 0; i + 2 < topology.indices.size(); i += 3) {
    mesh->faces.push_back({topology.indices[i], topology.indices[i + 1], topology.indices[i + 2]});
  }
  return mesh;
}

/// None before the first frame.
std::span<const v1::Layout::Joint> joints_of(const client::DecodedFrame& frame) {
  if (frame.joints == nullptr) return {};
  return *frame.joints;
}

bool same_layout(const client::DecodedFrame& a, const client::DecodedFrame& b) {
  return std::ranges::equal(a.bodies, b.bodies,
                            [](const auto& one, const auto& other) {
                              return one.name == other.name && one.topology->hash == other.topology->hash &&
                                     *one.kept_vertices == *other.kept_vertices;
                            }) &&
         std::ranges::equal(a.solids, b.solids,
                            [](const auto& one, const auto& other) {
                              return one.name == other.name && one.dynamic == other.dynamic &&
                                     one.shape.SerializeAsString() == other.shape.SerializeAsString() &&
                                     one.surface == other.surface;
                            }) &&
         std::ranges::equal(joints_of(a), joints_of(b), [](const auto& one, const auto& other) {
           return one.SerializeAsString() == other.SerializeAsString();
         });
}

}  // namespace

bool RecordedFrames::show(client::DecodedFrame frame) {
  const bool changed = !same_layout(frame_, frame);
  frame_ = std::move(frame);
  for (const client::SoftBodyFrame& body : frame_.bodies) {
    auto& mesh = meshes_[body.topology->hash];
    if (mesh == nullptr) mesh = mesh_of(body);
  }
  return changed;
}

std::shared_ptr<const physics::Mesh> RecordedFrames::mesh(std::size_t index) const {
  return meshes_.at(frame_.bodies[index].topology->hash);
}

void RecordedFrames::copy_positions(std::size_t index, std::span<double> out_m) const {
  std::ranges::copy(frame_.bodies[index].positions_m, out_m.begin());
}

const std::vector<std::uint32_t>& RecordedFrames::kept_vertices(std::size_t index) const {
  return *frame_.bodies[index].kept_vertices;
}

void RecordedFrames::copy_velocities(std::size_t index, std::span<double> out_m_s) const {
  std::ranges::copy(frame_.bodies[index].velocities_m_s, out_m_s.begin());
}

app::BodyScalars RecordedFrames::scalars(std::size_t index) const {
  const client::BodyScalars& scalars = frame_.bodies[index].scalars;
  return {.volume_m3 = scalars.volume_m3,
          .pressure_pa = scalars.pressure_pa,
          .kinetic_j = scalars.kinetic_j,
          .elastic_j = scalars.elastic_j,
          .asleep = scalars.asleep};
}

void RecordedFrames::describe_solids(v1::Layout& layout) const {
  for (const client::SolidFrame& solid : frame_.solids) {
    v1::Layout::Solid& out = *layout.add_solids();
    out.set_name(solid.name);
    *out.mutable_shape() = solid.shape;
    if (solid.surface) *out.mutable_surface() = *solid.surface;
    out.set_dynamic(solid.dynamic);
  }
}

void RecordedFrames::describe_joints(v1::Layout& layout) const {
  for (const v1::Layout::Joint& joint : joints_of(frame_)) *layout.add_joints() = joint;
}

std::vector<physics::Pose> RecordedFrames::poses() const {
  std::vector<physics::Pose> poses;
  poses.reserve(frame_.solids.size());
  for (const client::SolidFrame& solid : frame_.solids) {
    const auto& place = solid.position;
    const auto& turn = solid.orientation;
    poses.push_back({{place.x(), place.y(), place.z()}, {turn.w(), turn.x(), turn.y(), turn.z()}});
  }
  return poses;
}

}  // namespace pneuma::replay
