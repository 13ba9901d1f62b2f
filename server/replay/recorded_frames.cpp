#include "replay/recorded_frames.h"

#include <algorithm>
#include <utility>

namespace pneuma::replay {

namespace {

/// Faces, and as many vertices as they speak of: nobody asks where those were at rest.
std::shared_ptr<const physics::Mesh> mesh_of(const client::Topology& topology) {
  auto mesh = std::make_shared<physics::Mesh>();
  mesh->positions_m.resize(topology.vertex_count, Eigen::Vector3d::Zero());
  mesh->faces.reserve(topology.indices.size() / 3);
  for (std::size_t i = 0; i + 2 < topology.indices.size(); i += 3) {
    mesh->faces.push_back({topology.indices[i], topology.indices[i + 1], topology.indices[i + 2]});
  }
  return mesh;
}

bool same_layout(const client::DecodedFrame& a, const client::DecodedFrame& b) {
  return std::ranges::equal(a.bodies, b.bodies,
                            [](const auto& one, const auto& other) {
                              return one.name == other.name && one.topology->hash == other.topology->hash;
                            }) &&
         std::ranges::equal(a.solids, b.solids, [](const auto& one, const auto& other) {
           return one.name == other.name && one.dynamic == other.dynamic &&
                  one.shape.SerializeAsString() == other.shape.SerializeAsString();
         });
}

}  // namespace

bool RecordedFrames::show(client::DecodedFrame frame) {
  const bool changed = !same_layout(frame_, frame);
  frame_ = std::move(frame);
  for (const client::SoftBodyFrame& body : frame_.bodies) {
    auto& mesh = meshes_[body.topology->hash];
    if (mesh == nullptr) mesh = mesh_of(*body.topology);
  }
  return changed;
}

std::shared_ptr<const physics::Mesh> RecordedFrames::mesh(std::size_t index) const {
  return meshes_.at(frame_.bodies[index].topology->hash);
}

void RecordedFrames::copy_positions(std::size_t index, std::span<double> out_m) const {
  std::ranges::copy(frame_.bodies[index].positions_m, out_m.begin());
}

void RecordedFrames::describe_solids(v1::Layout& layout) const {
  for (const client::SolidFrame& solid : frame_.solids) {
    v1::Layout::Solid& out = *layout.add_solids();
    out.set_name(solid.name);
    *out.mutable_shape() = solid.shape;
    out.set_dynamic(solid.dynamic);
  }
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
