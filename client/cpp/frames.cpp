#include "pneuma_client/frames.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/limits.h"
#include "codec/topology_hash.h"

namespace pneuma::client {

namespace {

base::Status malformed(std::string what, std::string where) {
  return {base::StatusCode::malformed, std::move(what), std::move(where)};
}

std::string stream_name(std::uint32_t stream_id) {
  return "stream " + std::to_string(stream_id);
}

}  // namespace

StreamDecoder::StreamDecoder(const std::vector<TopologyPtr>& known) {
  for (const TopologyPtr& topology : known) topologies_.emplace(topology->hash, topology);
}

base::Status StreamDecoder::add_stream(const v1::Subscribed& subscribed) {
  const double step_m = subscribed.grid_step_m();
  if (!std::isfinite(step_m) || step_m <= 0.0) return malformed("the grid step is not a length", "grid_step_m");
  if (has_stream(subscribed.stream_id())) return {};  // asked for twice: it goes on as it was
  Stream stream;
  stream.world = subscribed.world();
  stream.grid_step_m = step_m;
  streams_.emplace(subscribed.stream_id(), std::move(stream));
  return {};
}

void StreamDecoder::remove_stream(std::uint32_t stream_id) {
  streams_.erase(stream_id);
}

base::Status StreamDecoder::take_topology(const v1::Topology& message) {
  const auto index_count = static_cast<std::size_t>(message.indices_size());
  if (message.vertex_count() > base::mesh_vertices_max || index_count > 3 * base::mesh_faces_max) {
    return malformed("larger than any mesh may be", "topology");
  }
  if (index_count % 3 != 0) return malformed("the indices are not three a face", "topology.indices");
  auto topology = std::make_shared<Topology>();
  topology->hash = message.hash();
  topology->vertex_count = message.vertex_count();
  topology->indices.assign(message.indices().begin(), message.indices().end());
  const auto bad =
      std::ranges::find_if(topology->indices, [&](std::uint32_t index) { return index >= message.vertex_count(); });
  if (bad != topology->indices.end()) {
    const auto face = (bad - topology->indices.begin()) / 3;
    return malformed("no vertex " + std::to_string(*bad), "topology.face[" + std::to_string(face) + "]");
  }
  if (codec::topology_hash(topology->vertex_count, topology->indices) != topology->hash) {
    return malformed("the hash is not that of the triangles", "topology.hash");
  }
  topology->order =
      std::make_shared<const codec::MeshOrder>(codec::make_mesh_order(topology->vertex_count, topology->indices));
  topologies_.emplace(topology->hash, std::move(topology));
  return {};
}

base::Status StreamDecoder::take_layout(const v1::Layout& message) {
  const auto found = streams_.find(message.stream_id());
  if (found == streams_.end()) return {};

  std::vector<Body> bodies;
  std::vector<codec::MeshOrderPtr> orders;
  std::size_t vertices = 0;
  for (const auto& soft : message.soft_bodies()) {
    const auto topology = topologies_.find(soft.topology_hash());
    if (topology == topologies_.end()) return malformed("its topology was never sent", "soft_bodies." + soft.name());
    vertices += topology->second->vertex_count;
    if (vertices > base::world_vertices_max || bodies.size() >= base::world_bodies_max) {
      return malformed("more than any world may hold", "layout");
    }
    bodies.push_back({soft.name(), topology->second});
    orders.push_back(topology->second->order);
  }
  std::vector<SolidFrame> solids;
  for (const auto& solid : message.solids()) {
    if (solids.size() >= base::world_bodies_max + base::world_colliders_max) {
      return malformed("more than any world may hold", "layout");
    }
    solids.push_back({solid.name(), solid.dynamic(), solid.shape(), {}, {}});
  }

  Stream& stream = found->second;
  stream.layout_id = message.layout_id();
  stream.bodies = std::move(bodies);
  stream.layers = {};
  stream.layers[0] = {std::nullopt, codec::FrameReader(std::move(orders)), std::move(solids)};
  return {};
}

base::Status StreamDecoder::check_frame(const Stream& stream, const v1::Frame& message) {
  const std::string where = stream_name(message.stream_id());
  if (stream.layout_id != message.layout_id()) {
    return malformed("a frame of layout " + std::to_string(message.layout_id()) + ", which was not sent", where);
  }
  if (message.layer() >= stream.layers.size()) return malformed("no layer " + std::to_string(message.layer()), where);
  if (!message.has_base_tick() && message.layer() != 0) return malformed("a key frame is of layer 0", where);
  if (message.has_base_tick() && base_of(stream, message) == nullptr) {
    return malformed("a frame on top of tick " + std::to_string(message.base_tick()) + ", which is not held", where);
  }
  for (const v1::Pose& pose : message.poses()) {
    if (pose.solid() >= stream.layers[0].solids.size()) {
      return malformed("a pose of solid " + std::to_string(pose.solid()) + ", which is not in the layout", where);
    }
  }
  return {};
}

const StreamDecoder::State* StreamDecoder::base_of(const Stream& stream, const v1::Frame& message) {
  // Of a lower layer, or both are of layer 0.
  for (std::size_t layer = 0; layer < std::max(1U, message.layer()); ++layer) {
    if (stream.layers[layer].tick == message.base_tick()) return &stream.layers[layer];
  }
  return nullptr;
}

base::Result<std::optional<DecodedFrame>> StreamDecoder::take_frame(const v1::Frame& message, std::size_t bytes) {
  const auto found = streams_.find(message.stream_id());
  if (found == streams_.end()) return std::optional<DecodedFrame>();
  Stream& stream = found->second;
  const bool key = !message.has_base_tick();
  const base::Status checked = check_frame(stream, message);
  if (!checked.ok()) return checked;
  State& state = stream.layers[message.layer()];
  if (message.layer() > 0) state = *base_of(stream, message);
  const base::Status decoded = state.reader.read(message.payload(), key);
  if (!decoded.ok()) return decoded.inside(stream_name(message.stream_id()));

  state.tick = message.tick();
  for (const v1::Pose& pose : message.poses()) {
    state.solids[pose.solid()].position = pose.position();
    state.solids[pose.solid()].orientation = pose.orientation();
  }
  DecodedFrame frame{.stream_id = message.stream_id(),
                     .world = stream.world,
                     .tick = message.tick(),
                     .time_s = message.time_s(),
                     .key = key,
                     .layer = message.layer(),
                     .bytes = bytes,
                     .bodies = {},
                     .solids = state.solids};
  frame.bodies.reserve(stream.bodies.size());
  for (std::size_t i = 0; i < stream.bodies.size(); ++i) {
    SoftBodyFrame& body = frame.bodies.emplace_back(stream.bodies[i].name, stream.bodies[i].topology);
    body.positions_m.resize(3 * std::size_t{body.topology->vertex_count});
    state.reader.positions(i, stream.grid_step_m, body.positions_m);
    constexpr double furthest_m = base::coordinate_max_m + base::max_error_max_m;
    if (!std::ranges::all_of(body.positions_m, [](double x_m) { return std::abs(x_m) <= furthest_m; })) {
      state.tick.reset();  // what builds on it is no better
      return malformed("a vertex past the largest coordinate", "payload");
    }
  }
  return std::optional(std::move(frame));
}

std::vector<TopologyPtr> StreamDecoder::topologies() const {
  std::vector<TopologyPtr> all;
  all.reserve(topologies_.size());
  for (const auto& [hash, topology] : topologies_) all.push_back(topology);
  return all;
}

}  // namespace pneuma::client
