#include "app/layout.h"

#include <algorithm>
#include <utility>

#include "app/mechanics.h"

namespace pneuma::app {

namespace {

/// In the vertices of the mesh that the source's own is a coarser version of, if it is one.
void describe_kept(const std::vector<std::uint32_t>& kept, const std::vector<std::uint32_t>& source_kept,
                   v1::Layout::Soft& soft) {
  if (kept.empty()) {
    soft.mutable_kept_vertices()->Add(source_kept.begin(), source_kept.end());
  } else if (source_kept.empty()) {
    soft.mutable_kept_vertices()->Add(kept.begin(), kept.end());
  } else {
    for (const std::uint32_t vertex : kept) soft.add_kept_vertices(source_kept[vertex]);
  }
}

}  // namespace

bool View::shows(const std::string& body) const {
  return bodies.empty() || std::ranges::binary_search(bodies, body);
}

WorldLayout::Update WorldLayout::update(const FrameSource& source, MeshTopologies& topologies) {
  if (current_) return Update::none;
  if (!find_bodies(source, topologies)) {
    topologies.make_missing();
    if (!find_bodies(source, topologies)) return Update::waits;
  }
  current_ = true;
  if (simulated_ticks_ > 0) find_mechanics(source);

  v1::Layout layout;
  for (const Body& body : bodies_) {
    v1::Layout::Soft& soft = *layout.add_soft_bodies();
    soft.set_name(source.soft_body_name(body.index));
    soft.set_topology_hash(body.topology->hash);
    describe_kept(body.topology->kept, source.kept_vertices(body.index), soft);
    if (body.mechanics) *soft.mutable_mechanics() = to_proto(*body.mechanics);
  }
  source.describe_solids(layout);
  layout.set_layout_id(layout_.layout_id());
  if (layout.layout_id() != 0 && layout.SerializeAsString() == layout_.SerializeAsString()) return Update::renewed;
  layout.set_layout_id(layout_.layout_id() + 1);
  layout_ = std::move(layout);
  return Update::changed;
}

/// False where a topology is not there yet.
bool WorldLayout::find_bodies(const FrameSource& source, MeshTopologies& topologies) {
  std::vector<Body> bodies;
  bool all_there = true;
  for (std::size_t i = 0; i < source.soft_body_count(); ++i) {
    if (!view_.shows(source.soft_body_name(i))) continue;
    TopologyMessagePtr topology = topologies.find(source.mesh(i), view_.level);
    all_there = all_there && topology != nullptr;
    bodies.push_back({i, std::move(topology)});
  }
  bodies_ = std::move(bodies);  // those that wait hold what they have
  return all_there;
}

/// Of the first bodies, as many as readers will simulate.
void WorldLayout::find_mechanics(const FrameSource& source) {
  const double frame_s = source.tick_period_s() * static_cast<double>(simulated_ticks_);
  std::uint64_t work = 0;
  for (Body& body : bodies_) {
    auto mechanics = source.mechanics(body.index, *body.topology->order, frame_s);
    if (!mechanics) continue;
    const std::uint64_t own_work =
        codec::simulated_work(*mechanics, body.topology->order->size(), source.mesh(body.index)->faces.size());
    if (work + own_work > codec::simulated_work_max) continue;
    work += own_work;
    body.mechanics = std::move(mechanics);
  }
}

std::vector<TopologyMessagePtr> WorldLayout::topologies() const {
  std::vector<TopologyMessagePtr> out;
  for (const Body& body : bodies_) {
    if (std::ranges::find(out, body.topology) == out.end()) out.push_back(body.topology);
  }
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
  for (const Body& body : bodies_) count += body.topology->order->size();
  return count;
}

}  // namespace pneuma::app
