#include "pneuma_client/frames.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "base/limits.h"
#include "codec/topology_hash.h"
#include "mechanics.h"

namespace pneuma::client {

namespace {

base::Status malformed(std::string what, std::string where) {
  return {base::StatusCode::malformed, std::move(what), std::move(where)};
}

std::string stream_name(std::uint32_t stream_id) {
  return "stream " + std::to_string(stream_id);
}

/// Whether a joint's end is on one of so many bodies or solids, or of the world; of a body with up to three vertices.
bool is_end_of(const v1::Layout::Joint::End& end, std::size_t bodies, std::size_t solids) {
  if (end.has_solid()) return end.solid() < solids;
  if (!end.has_soft()) return true;
  return end.soft() < bodies && end.vertices_size() >= 1 && end.vertices_size() <= 3 &&
         end.weights_size() == end.vertices_size();
}

/// Which vertices of a mesh the `count` of a topology are; nothing where they are all.
bool is_subset(const std::vector<std::uint32_t>& kept, std::uint32_t count) {
  if (kept.empty()) return true;
  return kept.size() == count && kept.back() < base::mesh_vertices_max &&
         std::ranges::adjacent_find(kept, std::greater_equal<>()) == kept.end();
}

/// Null where the body has no mechanics. Adds to the work of those before it.
base::Result<codec::SimulatedMotionPtr> simulation_of(const v1::Layout::Soft& soft, const Topology& topology,
                                                      const codec::MeshOrderPtr& order, double grid_step_m,
                                                      std::uint64_t& work) {
  if (!soft.has_mechanics()) return codec::SimulatedMotionPtr();
  const auto mechanics = mechanics_of(soft.mechanics(), *order, grid_step_m);
  if (!mechanics.ok()) return mechanics.status().inside("mechanics");
  work += codec::simulated_work(mechanics->substeps, topology.vertex_count, topology.indices.size() / 3,
                                mechanics->planes.size());
  if (work > codec::simulated_work_max) return malformed("more to be simulated than any stream asks for", "mechanics");
  return std::make_shared<codec::SimulatedMotion>(order, topology.indices, *mechanics, grid_step_m);
}

std::vector<ContactFrame> contacts_of(const v1::Frame& message) {
  std::vector<ContactFrame> contacts;
  for (const v1::Contact& contact : message.contacts()) {
    ContactFrame& out = contacts.emplace_back();
    out.body = contact.soft();
    out.vertex = contact.vertex();
    if (contact.has_other_soft()) out.other_body = contact.other_soft();
    if (contact.has_other_solid()) out.other_solid = contact.other_solid();
    out.normal = {contact.normal().x(), contact.normal().y(), contact.normal().z()};
  }
  return contacts;
}

}  // namespace

StreamDecoder::StreamDecoder(const std::vector<TopologyPtr>& known) {
  for (const TopologyPtr& topology : known) topologies_.emplace(topology->hash, topology);
}

base::Status StreamDecoder::add_stream(const v1::Subscribed& subscribed) {
  const double step_m = subscribed.grid_step_m();
  if (!std::isfinite(step_m) || step_m <= 0.0) return malformed("the grid step is not a length", "grid_step_m");
  const double velocity_step_m_s = subscribed.velocity_grid_step_m_s();
  if (!std::isfinite(velocity_step_m_s) || velocity_step_m_s < 0.0) {
    return malformed("the grid step is not a speed", "velocity_grid_step_m_s");
  }
  if (!std::isfinite(subscribed.tick_s()) || subscribed.tick_s() < 0.0) return malformed("is not a time", "tick_s");
  if (has_stream(subscribed.stream_id())) return {};  // asked for twice: it goes on as it was
  Stream stream;
  stream.world = subscribed.world();
  stream.grid_step_m = step_m;
  stream.velocity_grid_step_m_s = velocity_step_m_s;
  stream.tick_s = subscribed.tick_s();
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
  topologies_.emplace(topology->hash, std::move(topology));
  return {};
}

codec::MeshOrderPtr StreamDecoder::order_of(const Topology& topology) {
  std::weak_ptr<const codec::MeshOrder>& known = orders_[topology.hash];
  if (codec::MeshOrderPtr order = known.lock(); order != nullptr) return order;
  const auto order =
      std::make_shared<const codec::MeshOrder>(codec::make_mesh_order(topology.vertex_count, topology.indices));
  known = order;
  return order;
}

base::Status StreamDecoder::take_layout(const v1::Layout& message) {
  const auto found = streams_.find(message.stream_id());
  if (found == streams_.end()) return {};

  std::vector<Body> bodies;
  std::vector<codec::MeshOrderPtr> orders;
  std::vector<codec::SimulatedMotionPtr> simulations;
  std::uint64_t simulated_work = 0;
  std::size_t vertices = 0;
  for (const auto& soft : message.soft_bodies()) {
    const auto topology = topologies_.find(soft.topology_hash());
    if (topology == topologies_.end()) return malformed("its topology was never sent", "soft_bodies." + soft.name());
    vertices += topology->second->vertex_count;
    if (vertices > base::world_vertices_max || bodies.size() >= base::world_bodies_max) {
      return malformed("more than any world may hold", "layout");
    }
    auto kept = std::make_shared<std::vector<std::uint32_t>>(soft.kept_vertices().begin(), soft.kept_vertices().end());
    if (!is_subset(*kept, topology->second->vertex_count)) {
      return malformed("the vertices kept are not one a vertex, ascending", "soft_bodies." + soft.name());
    }
    bodies.push_back({soft.name(), topology->second, std::move(kept)});
    orders.push_back(order_of(*topology->second));
    auto simulation = simulation_of(soft, *topology->second, orders.back(), found->second.grid_step_m, simulated_work);
    if (!simulation.ok()) return simulation.status().inside("soft_bodies." + soft.name());
    simulations.push_back(std::move(*simulation));
  }
  std::vector<SolidFrame> solids;
  for (const auto& solid : message.solids()) {
    if (solids.size() >= base::world_bodies_max + base::world_colliders_max) {
      return malformed("more than any world may hold", "layout");
    }
    const auto surface = solid.has_surface() ? std::make_shared<const v1::Mesh::Triangles>(solid.surface()) : nullptr;
    solids.push_back({solid.name(), solid.dynamic(), solid.shape(), {}, {}, surface});
  }
  if (static_cast<std::size_t>(message.joints_size()) > base::world_joints_max) {
    return malformed("more than any world may hold", "layout");
  }
  for (const auto& joint : message.joints()) {
    for (const auto* end : {&joint.first(), &joint.second()}) {
      if (is_end_of(*end, bodies.size(), solids.size())) continue;
      return malformed("an end is on nothing that was told", "joints." + joint.name());
    }
  }

  Stream& stream = found->second;
  stream.layout_id = message.layout_id();
  stream.bodies = std::move(bodies);
  stream.joints =
      std::make_shared<const std::vector<v1::Layout::Joint>>(message.joints().begin(), message.joints().end());
  stream.layers = {};
  State& base = stream.layers[0];
  if (stream.velocity_grid_step_m_s > 0.0) base.velocity_reader = codec::FrameReader(orders);
  base.reader = codec::FrameReader(std::move(orders), std::move(simulations));
  base.solids = std::move(solids);
  return {};
}

base::Status StreamDecoder::check_frame(const Stream& stream, const v1::Frame& message) {
  const std::string where = stream_name(message.stream_id());
  const bool of_base = message.has_base_tick() && message.layout_id() == 0;
  if (!of_base && stream.layout_id != message.layout_id()) {
    return malformed("a frame of layout " + std::to_string(message.layout_id()) + ", which was not sent", where);
  }
  if (message.layer() >= stream.layers.size()) return malformed("no layer " + std::to_string(message.layer()), where);
  if (!message.has_base_tick() && message.layer() != 0) return malformed("a key frame is of layer 0", where);
  if (message.has_base_tick() && base_of(stream, message) == nullptr) {
    return malformed("a frame on top of tick " + std::to_string(message.base_tick()) + ", which is not held", where);
  }
  if (message.has_base_tick() && message.tick() < message.base_tick()) return malformed("before its base", where);
  for (const v1::Pose& pose : message.poses()) {
    if (pose.solid() >= stream.layers[0].solids.size()) {
      return malformed("a pose of solid " + std::to_string(pose.solid()) + ", which is not in the layout", where);
    }
  }
  const auto has_one_a_body = [&](int count) { return static_cast<std::size_t>(count) == stream.bodies.size(); };
  const v1::Scalars& scalars = message.scalars();
  if (message.has_scalars() &&
      !(has_one_a_body(scalars.volume_m3_size()) && has_one_a_body(scalars.pressure_pa_size()) &&
        has_one_a_body(scalars.kinetic_j_size()) && has_one_a_body(scalars.elastic_j_size()) &&
        has_one_a_body(scalars.asleep_size()))) {
    return malformed("the scalars are not one a body", where);
  }
  return check_contacts(stream, message);
}

base::Status StreamDecoder::check_contacts(const Stream& stream, const v1::Frame& message) {
  const auto has_vertex = [&](const v1::Contact& contact) {
    const Body& body = stream.bodies[contact.soft()];
    // Of a mesh of which only some vertices are shown, the size is not known.
    return contact.vertex() < (body.kept_vertices->empty() ? body.topology->vertex_count : base::mesh_vertices_max);
  };
  const auto is_sound = [&](const v1::Contact& contact) {
    const v1::Vec3& normal = contact.normal();
    return contact.soft() < stream.bodies.size() && has_vertex(contact) &&
           (!contact.has_other_soft() || contact.other_soft() < stream.bodies.size()) &&
           (!contact.has_other_solid() || contact.other_solid() < stream.layers[0].solids.size()) &&
           std::isfinite(normal.x()) && std::isfinite(normal.y()) && std::isfinite(normal.z());
  };
  if (static_cast<std::size_t>(message.contacts_size()) <= base::frame_contacts_max &&
      std::ranges::all_of(message.contacts(), is_sound)) {
    return {};
  }
  return malformed("contacts that cannot be", stream_name(message.stream_id()));
}

/// A failure may come with the positions read already: the stream then waits for a key frame.
base::Status StreamDecoder::read_vectors(const Stream& stream, State& state, const v1::Frame& message) {
  const bool key = !message.has_base_tick();
  base::Status read = state.reader.read(message.payload(), key);
  if (!read.ok() || stream.velocity_grid_step_m_s == 0.0) return read;
  read = state.velocity_reader.read(message.velocities(), key);
  if (read.ok()) return read;
  state.tick.reset();
  return read.inside("velocities");
}

/// Whether what was read is what the server has.
base::Status StreamDecoder::verify(const Stream& stream, const State& state, const v1::Frame& message) {
  const auto differs = [&](const char* what, std::uint32_t ours, std::uint32_t theirs) {
    return malformed(std::string(what) + " at tick " + std::to_string(message.tick()) +
                         " are not the server's: their check is " + std::to_string(ours) + ", not " +
                         std::to_string(theirs),
                     stream_name(message.stream_id()));
  };
  if (message.has_check() && state.reader.check() != message.check()) {
    return differs("the vertices", state.reader.check(), message.check());
  }
  if (stream.velocity_grid_step_m_s > 0.0 && message.has_velocities_check() &&
      state.velocity_reader.check() != message.velocities_check()) {
    return differs("the velocities", state.velocity_reader.check(), message.velocities_check());
  }
  return {};
}

base::Status StreamDecoder::fill_bodies(const Stream& stream, const State& state, const v1::Frame& message,
                                        DecodedFrame& frame) {
  constexpr double furthest = base::coordinate_max_m + base::max_error_max_m;
  const auto are_near = [](const std::vector<double>& vectors) {
    return std::ranges::all_of(vectors, [](double x) { return std::abs(x) <= furthest; });
  };
  frame.has_velocities = stream.velocity_grid_step_m_s > 0.0;
  frame.has_scalars = message.has_scalars();
  frame.bodies.reserve(stream.bodies.size());
  for (std::size_t i = 0; i < stream.bodies.size(); ++i) {
    SoftBodyFrame& body = frame.bodies.emplace_back();
    body.name = stream.bodies[i].name;
    body.topology = stream.bodies[i].topology;
    body.kept_vertices = stream.bodies[i].kept_vertices;
    body.positions_m.resize(3 * std::size_t{body.topology->vertex_count});
    state.reader.positions(i, stream.grid_step_m, body.positions_m);
    if (!are_near(body.positions_m)) return malformed("a vertex past the largest coordinate", "payload");
    if (frame.has_velocities) {
      body.velocities_m_s.resize(body.positions_m.size());
      state.velocity_reader.positions(i, stream.velocity_grid_step_m_s, body.velocities_m_s);
      if (!are_near(body.velocities_m_s)) return malformed("a vertex past the largest velocity", "velocities");
    }
    if (frame.has_scalars) {
      const v1::Scalars& scalars = message.scalars();
      const int at = static_cast<int>(i);
      body.scalars = {scalars.volume_m3(at), scalars.pressure_pa(at), scalars.kinetic_j(at), scalars.elastic_j(at),
                      scalars.asleep(at)};
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
  if (stream.waits_for_key && !key) return std::optional<DecodedFrame>();
  const base::Status checked = check_frame(stream, message);
  if (!checked.ok()) return checked;
  State& state = stream.layers[message.layer()];
  if (message.layer() > 0) state = *base_of(stream, message);
  double time_s = message.time_s();
  if (!message.has_time_s() && !key) {
    time_s = state.time_s + static_cast<double>(message.tick() - message.base_tick()) * stream.tick_s;
  }
  const base::Status decoded = read_vectors(stream, state, message);
  if (!decoded.ok()) return decoded.inside(stream_name(message.stream_id()));
  if (base::Status verified = verify(stream, state, message); !verified.ok()) {
    state.tick.reset();
    stream.waits_for_key = !key;  // a reader that takes a key frame wrong is not helped by another
    return verified;
  }
  stream.waits_for_key = false;

  state.tick = message.tick();
  state.time_s = time_s;
  for (const v1::Pose& pose : message.poses()) {
    state.solids[pose.solid()].position = pose.position();
    state.solids[pose.solid()].orientation = pose.orientation();
  }
  DecodedFrame frame{.stream_id = message.stream_id(),
                     .world = stream.world,
                     .tick = message.tick(),
                     .time_s = time_s,
                     .key = key,
                     .layer = message.layer(),
                     .bytes = bytes,
                     .has_velocities = false,
                     .has_scalars = false,
                     .bodies = {},
                     .solids = state.solids,
                     .contacts = contacts_of(message),
                     .joints = stream.joints};
  if (const base::Status filled = fill_bodies(stream, state, message, frame); !filled.ok()) {
    state.tick.reset();  // what builds on it is no better
    return filled;
  }
  return std::optional(std::move(frame));
}

bool StreamDecoder::waits_for_key(std::uint32_t stream_id) const {
  const auto found = streams_.find(stream_id);
  return found != streams_.end() && found->second.waits_for_key;
}

std::vector<TopologyPtr> StreamDecoder::topologies() const {
  std::vector<TopologyPtr> all;
  all.reserve(topologies_.size());
  for (const auto& [hash, topology] : topologies_) all.push_back(topology);
  return all;
}

}  // namespace pneuma::client
