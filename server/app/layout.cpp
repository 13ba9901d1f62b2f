#include "app/layout.h"

#include <algorithm>
#include <cmath>
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

WorldLayout::Update WorldLayout::update(const FrameSource& source, MeshTopologies& topologies, std::uint64_t tick) {
  const bool looks = looks_at_mechanics(source, tick);
  if (current_ && !looks) return Update::none;
  const bool was_current = current_;
  if (!was_current && !find_bodies(source, topologies)) {
    topologies.make_missing();
    if (!find_bodies(source, topologies)) return Update::waits;
  }
  current_ = true;
  if (looks) {
    find_mechanics(source);
    mechanics_current_ = true;
    mechanics_tick_ = tick;
  }
  v1::Layout layout = describe(source);
  if (layout.layout_id() != 0 && layout.SerializeAsString() == layout_.SerializeAsString()) {
    return was_current ? Update::none : Update::renewed;
  }
  layout.set_layout_id(layout_.layout_id() + 1);
  layout_ = std::move(layout);
  return Update::changed;
}

/// Of the bodies as they are, with the id of the one before.
v1::Layout WorldLayout::describe(const FrameSource& source) const {
  v1::Layout layout;
  for (const Body& body : bodies_) {
    v1::Layout::Soft& soft = *layout.add_soft_bodies();
    soft.set_name(body.name);
    soft.set_topology_hash(body.topology->hash);
    describe_kept(body.topology->kept, source.kept_vertices(body.index), soft);
    if (body.mechanics) *soft.mutable_mechanics() = to_proto(*body.mechanics);
  }
  source.describe_solids(layout);
  source.describe_joints(layout);
  keep_joints_of_shown(layout);
  layout.set_layout_id(layout_.layout_id());
  return layout;
}

/// The bodies of a stream are counted among themselves; joints of others are not in it.
void WorldLayout::keep_joints_of_shown(v1::Layout& layout) const {
  const auto find = [&](v1::Layout::Joint::End& end) {
    if (!end.has_soft()) return true;
    const auto body = std::ranges::find(bodies_, std::size_t{end.soft()}, &Body::index);
    end.set_soft(static_cast<std::uint32_t>(body - bodies_.begin()));
    return body != bodies_.end();
  };
  for (int i = layout.joints_size() - 1; i >= 0; --i) {
    v1::Layout::Joint& joint = *layout.mutable_joints(i);
    const bool shown = find(*joint.mutable_first()) && find(*joint.mutable_second());
    if (!shown) layout.mutable_joints()->DeleteSubrange(i, 1);
  }
}

/// False where a topology is not there yet. A body of the same name and topology has the mechanics that were told.
bool WorldLayout::find_bodies(const FrameSource& source, MeshTopologies& topologies) {
  std::vector<Body> bodies;
  bool all_there = true;
  for (std::size_t i = 0; i < source.soft_body_count(); ++i) {
    const std::string& name = source.soft_body_name(i);
    if (!view_.shows(name)) continue;
    Body& body = bodies.emplace_back(Body{i, name, topologies.find(source.mesh(i), view_.level)});
    all_there = all_there && body.topology != nullptr;
    const auto same = std::ranges::find_if(bodies_, [&](const Body& before) {
      return before.mechanics && before.name == name && body.topology != nullptr &&
             before.topology->hash == body.topology->hash;
    });
    if (same != bodies_.end()) body.mechanics = std::move(same->mechanics);
  }
  bodies_ = std::move(bodies);  // those that wait hold what they have
  return all_there;
}

/// A layout with mechanics is large and not to be left out, so whoever edits without end must not have one sent each
/// time. What moves a body otherwise until then costs bits, nothing else.
bool WorldLayout::looks_at_mechanics(const FrameSource& source, std::uint64_t tick) const {
  if (simulated_.ticks == 0 || mechanics_current_) return false;
  const auto second = static_cast<std::uint64_t>(std::lround(1.0 / source.tick_period_s()));
  return !mechanics_tick_ || tick - *mechanics_tick_ >= second;
}

/// Of the first bodies, as many as are offered.
void WorldLayout::find_mechanics(const FrameSource& source) {
  MechanicsTerms terms{.frame_s = source.tick_period_s() * static_cast<double>(simulated_.ticks),
                       .grid_step_m = simulated_.grid_step_m,
                       .work_left = offered_work_max};
  for (Body& body : bodies_) body.mechanics = source.mechanics(body.index, *body.topology->order, terms);
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
