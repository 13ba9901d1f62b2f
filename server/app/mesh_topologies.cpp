#include "app/mesh_topologies.h"

#include <algorithm>
#include <exception>
#include <mutex>
#include <optional>
#include <span>

#include <spdlog/spdlog.h>

#include "app/protocol.h"
#include "codec/topology_hash.h"
#include "physics/mesh/coarse_mesh.h"

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
  void make(const Key& key);

  std::mutex mutex;
  bool busy = false;
  std::optional<std::pair<Key, TopologyMessagePtr>> made;
};

void MeshTopologies::Workshop::make(const Key& key) {
  TopologyMessagePtr topology;
  try {
    topology = coarse_topology_of(*key.first, key.second);
  } catch (const std::exception& error) {  // out of memory, most likely; who waits asks again
    spdlog::error("a mesh at level {} could not be made: {}", key.second, error.what());
  }
  const std::lock_guard lock(mutex);
  if (topology != nullptr) made.emplace(key, std::move(topology));
  busy = false;
}

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
  for (const Key& key : missing_) {
    if (collect()) return;
    if (found_.contains(key)) continue;
    workshop_->busy = true;
    defer_(key.first->positions_m.size(), [workshop = workshop_, key] { workshop->make(key); });
  }
  static_cast<void>(collect());
}

/// True where a job is under way.
bool MeshTopologies::collect() {
  const std::lock_guard lock(workshop_->mutex);
  if (auto made = std::exchange(workshop_->made, std::nullopt)) found_.insert(std::move(*made));
  return workshop_->busy;
}

void MeshTopologies::drop_unused() {
  const auto is_asked_for = [this](const Key& key) { return std::ranges::find(missing_, key) != missing_.end(); };
  std::erase_if(found_, [&](const auto& entry) { return entry.second.use_count() == 1 && !is_asked_for(entry.first); });
  missing_.clear();
}

}  // namespace pneuma::app
