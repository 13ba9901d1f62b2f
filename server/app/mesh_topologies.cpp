#include "app/mesh_topologies.h"

#include <algorithm>
#include <mutex>
#include <span>

#include "app/protocol.h"
#include "codec/topology_hash.h"
#include "physics/coarse_mesh.h"

namespace pneuma::app {

namespace {

TopologyMessagePtr topology_of(std::size_t vertices, std::span<const physics::Face> faces,
                               std::vector<std::uint32_t> kept) {
  const auto vertex_count = static_cast<std::uint32_t>(vertices);
  const std::span<const std::uint32_t> indices(faces.empty() ? nullptr : faces.front().data(), 3 * faces.size());
  TopologyMessage topology;
  topology.hash = codec::topology_hash(vertex_count, indices);
  v1::ServerMessage message;
  v1::Topology& out = *message.mutable_topology();
  out.set_hash(topology.hash);
  out.set_vertex_count(vertex_count);
  out.mutable_indices()->Add(indices.begin(), indices.end());
  topology.message = serialise(message);
  topology.order = std::make_shared<const codec::MeshOrder>(codec::make_mesh_order(vertex_count, indices));
  topology.kept = std::move(kept);
  return std::make_shared<const TopologyMessage>(std::move(topology));
}

TopologyMessagePtr coarse_topology_of(const physics::Mesh& mesh, std::uint32_t level) {
  physics::CoarseMesh coarse = physics::coarsen(mesh.positions_m, mesh.faces, level);
  const std::size_t vertices = coarse.kept.size();
  return topology_of(vertices, coarse.faces, std::move(coarse.kept));
}

}  // namespace

struct MeshTopologies::Workshop {
  std::mutex mutex;
  bool busy = false;
  std::vector<std::pair<Key, TopologyMessagePtr>> made;
};

MeshTopologies::MeshTopologies(Defer defer) : defer_(std::move(defer)), workshop_(std::make_shared<Workshop>()) {}

TopologyMessagePtr MeshTopologies::find(const std::shared_ptr<const physics::Mesh>& mesh, std::uint32_t level) {
  const Key key(mesh, level);
  const auto known = found_.find(key);
  if (known != found_.end()) return known->second;
  if (level == 0) return found_[key] = topology_of(mesh->positions_m.size(), mesh->faces, {});
  if (std::ranges::find(missing_, key) == missing_.end()) missing_.push_back(key);
  return nullptr;
}

void MeshTopologies::make_missing() {
  if (collect() || missing_.empty()) return;
  workshop_->busy = true;
  defer_([workshop = workshop_, keys = std::exchange(missing_, {})] {
    for (const auto& [mesh, level] : keys) {
      TopologyMessagePtr topology = coarse_topology_of(*mesh, level);
      const std::lock_guard lock(workshop->mutex);
      workshop->made.emplace_back(Key(mesh, level), std::move(topology));
    }
    const std::lock_guard lock(workshop->mutex);
    workshop->busy = false;
  });
  static_cast<void>(collect());
}

/// What was made is missing no more. True where a job is under way.
bool MeshTopologies::collect() {
  const std::lock_guard lock(workshop_->mutex);
  for (auto& [key, topology] : workshop_->made) {
    std::erase(missing_, key);
    found_.insert_or_assign(key, std::move(topology));
  }
  workshop_->made.clear();
  return workshop_->busy;
}

void MeshTopologies::drop_unused() {
  std::erase_if(found_, [](const auto& entry) { return entry.second.use_count() == 1; });
}

}  // namespace pneuma::app
