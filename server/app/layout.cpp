#include "app/layout.h"

#include <span>
#include <utility>

#include "app/protocol.h"
#include "codec/topology_hash.h"

namespace pneuma::app {

namespace {

TopologyMessage topology_of(const physics::Mesh& mesh) {
  const auto vertex_count = static_cast<std::uint32_t>(mesh.positions_m.size());
  const std::span<const std::uint32_t> indices(mesh.faces.empty() ? nullptr : mesh.faces.front().data(),
                                               3 * mesh.faces.size());
  TopologyMessage topology;
  topology.hash = codec::topology_hash(vertex_count, indices);
  v1::ServerMessage message;
  v1::Topology& out = *message.mutable_topology();
  out.set_hash(topology.hash);
  out.set_vertex_count(vertex_count);
  out.mutable_indices()->Add(indices.begin(), indices.end());
  topology.message = serialise(message);
  topology.order = std::make_shared<const codec::MeshOrder>(codec::make_mesh_order(vertex_count, indices));
  return topology;
}

}  // namespace

bool WorldLayout::update(const FrameSource& source) {
  v1::Layout layout;
  std::map<std::shared_ptr<const physics::Mesh>, TopologyMessage> topologies;
  orders_.clear();
  for (std::size_t i = 0; i < source.soft_body_count(); ++i) {
    const std::shared_ptr<const physics::Mesh> mesh = source.mesh(i);
    auto& topology = topologies[mesh];
    if (const auto known = topologies_.find(mesh); known != topologies_.end()) topology = known->second;
    if (topology.message == nullptr) topology = topology_of(*mesh);
    orders_.push_back(topology.order);
    v1::Layout::Soft& soft = *layout.add_soft_bodies();
    soft.set_name(source.soft_body_name(i));
    soft.set_topology_hash(topology.hash);
  }
  source.describe_solids(layout);

  topologies_ = std::move(topologies);
  layout.set_layout_id(layout_.layout_id());
  if (layout.layout_id() != 0 && layout.SerializeAsString() == layout_.SerializeAsString()) return false;
  layout.set_layout_id(layout_.layout_id() + 1);
  layout_ = std::move(layout);
  return true;
}

std::vector<TopologyMessage> WorldLayout::topologies() const {
  std::vector<TopologyMessage> out;
  for (const auto& [mesh, topology] : topologies_) out.push_back(topology);
  return out;
}

v1::ServerMessage WorldLayout::message(std::uint32_t stream_id) const {
  v1::ServerMessage message;
  *message.mutable_layout() = layout_;
  message.mutable_layout()->set_stream_id(stream_id);
  return message;
}

std::size_t WorldLayout::vertex_count() const {
  std::size_t count = 0;
  for (const codec::MeshOrderPtr& order : orders_) count += order->size();
  return count;
}

}  // namespace pneuma::app
