#include "app/frame_encoder.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "app/frame_contacts.h"
#include "app/protocol.h"
#include "scene_io/vectors.h"

namespace pneuma::app {

namespace {

// As far as a reader's reckoning may be off; a frame's time is told where it is further.
constexpr double time_tolerance_s = 1e-9;

bool same(const physics::Pose& a, const physics::Pose& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

void add_pose(v1::Frame& frame, std::size_t solid, const physics::Pose& pose) {
  v1::Pose& out = *frame.add_poses();
  out.set_solid(static_cast<std::uint32_t>(solid));
  scene_io::set(*out.mutable_position(), pose.position);
  scene_io::set(*out.mutable_orientation(), pose.orientation);
}

codec::SimulatedMotionPtr simulation_of(const physics::Mesh& mesh, const WorldLayout::Body& body, double max_error_m) {
  const std::span<const std::uint32_t> indices(mesh.faces.front().data(), 3 * mesh.faces.size());
  return std::make_shared<codec::SimulatedMotion>(body.topology->order, indices, *body.mechanics,
                                                  codec::grid_step_m(max_error_m));
}

}  // namespace

const std::optional<BodyScalars>& MeasuredScalars::of(std::size_t body) {
  measured_.resize(source_.soft_body_count());
  std::optional<BodyScalars>& measured = measured_[body];
  if (!measured && source_.has_scalars()) measured = source_.scalars(body);
  return measured;
}

FrameEncoder::FrameEncoder(std::uint32_t stream_id, const FrameContents& contents)
    : stream_id_(stream_id), contents_(contents) {
  if (contents.plain) plain_.emplace();
}

net::StreamFrame FrameEncoder::encode(const FrameSource& source, MeasuredScalars& scalars, std::uint64_t tick,
                                      const WorldLayout& layout, std::uint32_t layer, bool with_key) {
  const bool same_layout = writer_ && layout_id_ == layout.id();
  const bool delta = same_layout && last_tick_ && *last_tick_ < tick;  // never of a plain stream, which has no writer
  const std::optional<std::uint64_t> base_tick = last_tick_;
  const std::vector<physics::Pose> base_poses = std::exchange(poses_, source.poses());
  if (!same_layout) begin_layout(source, layout);
  last_tick_ = tick;
  const double reckoned_s = delta ? time_s_ + static_cast<double>(tick - *base_tick) * contents_.tick_s : 0.0;
  const bool reckons = delta && std::abs(reckoned_s - source.time_s()) <= time_tolerance_s;
  time_s_ = reckons ? reckoned_s : source.time_s();
  vertices_ = layout.vertex_count();
  if (contents_.scalars) take_scalars(scalars, layout);
  if (contents_.contacts) contacts_ = contacts_of(source, layout);
  layer_ = layer;

  net::StreamFrame out;
  out.stream_id = stream_id_;
  out.tick = tick;
  out.layer = layer;
  out.vertices = vertices_;
  v1::ServerMessage message = header();
  v1::Frame& frame = *message.mutable_frame();
  if (plain_) {
    take_plain(source, layout);
  } else {
    write(source, &FrameSource::copy_positions, layout, *writer_, delta ? frame.mutable_payload() : nullptr);
  }
  if (velocity_writer_) {
    write(source, &FrameSource::copy_velocities, layout, *velocity_writer_,
          delta ? frame.mutable_velocities() : nullptr);
  }
  if (delta) {
    add_checks(frame);
    out.base_tick = *base_tick;
    frame.set_base_tick(*base_tick);
    if (!reckons) frame.set_time_s(time_s_);
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      if (!same(poses_[i], base_poses[i])) add_pose(frame, i, poses_[i]);
    }
    out.delta = serialise(message);
  }
  if (with_key || !delta) out.key = key();
  return out;
}

void FrameEncoder::begin_layout(const FrameSource& source, const WorldLayout& layout) {
  layout_id_ = layout.id();
  if (plain_) return;
  std::vector<codec::MeshOrderPtr> orders;
  std::vector<codec::SimulatedMotionPtr> simulations;
  for (const WorldLayout::Body& body : layout.bodies()) {
    orders.push_back(body.topology->order);
    simulations.push_back(body.mechanics ? simulation_of(*source.mesh(body.index), body, contents_.max_error_m)
                                         : nullptr);
  }
  if (contents_.velocities) velocity_writer_.emplace(orders, contents_.max_velocity_error_m_s);
  writer_.emplace(std::move(orders), contents_.max_error_m, std::move(simulations));
}

void FrameEncoder::write(const FrameSource& source, Copy copy, const WorldLayout& layout, codec::FrameWriter& writer,
                         std::string* payload) {
  const std::vector<WorldLayout::Body>& bodies = layout.bodies();
  if (payload == nullptr) {
    for (std::size_t i = 0; i < bodies.size(); ++i) writer.place_body(i, vectors_of(source, copy, bodies[i]));
    return;
  }
  writer.begin_delta();
  for (std::size_t i = 0; i < bodies.size(); ++i) writer.move_body(i, vectors_of(source, copy, bodies[i]));
  writer.take_delta(*payload);
}

void FrameEncoder::take_plain(const FrameSource& source, const WorldLayout& layout) {
  gather(source, &FrameSource::copy_positions, layout);
  plain_->take_positions(numbers_, contents_.max_error_m);
  if (!contents_.velocities) return;
  gather(source, &FrameSource::copy_velocities, layout);
  plain_->take_velocities(numbers_, contents_.max_velocity_error_m_s);
}

void FrameEncoder::gather(const FrameSource& source, Copy copy, const WorldLayout& layout) {
  numbers_.clear();
  for (const WorldLayout::Body& body : layout.bodies()) {
    const std::span<const double> vectors = vectors_of(source, copy, body);
    numbers_.insert(numbers_.end(), vectors.begin(), vectors.end());
  }
}

/// Three numbers of each vertex that the stream shows of the body.
std::span<const double> FrameEncoder::vectors_of(const FrameSource& source, Copy copy, const WorldLayout::Body& body) {
  vectors_.resize(3 * source.mesh(body.index)->positions_m.size());
  (source.*copy)(body.index, vectors_);
  const std::vector<std::uint32_t>& kept = body.topology->kept;
  if (kept.empty()) return vectors_;
  for (std::size_t i = 0; i < kept.size(); ++i) {  // ascending, so none is written over before it is read
    std::copy_n(vectors_.begin() + 3 * static_cast<std::ptrdiff_t>(kept[i]), 3,
                vectors_.begin() + 3 * static_cast<std::ptrdiff_t>(i));
  }
  return std::span<const double>(vectors_).first(3 * kept.size());
}

void FrameEncoder::take_scalars(MeasuredScalars& scalars, const WorldLayout& layout) {
  scalars_.emplace();
  for (const WorldLayout::Body& body : layout.bodies()) {
    const std::optional<BodyScalars>& measured = scalars.of(body.index);
    if (!measured) return scalars_.reset();
    scalars_->add_volume_m3(static_cast<float>(measured->volume_m3));
    scalars_->add_pressure_pa(static_cast<float>(measured->pressure_pa));
    scalars_->add_kinetic_j(static_cast<float>(measured->kinetic_j));
    scalars_->add_elastic_j(static_cast<float>(measured->elastic_j));
    scalars_->add_asleep(measured->asleep);
  }
}

net::StreamFrame FrameEncoder::last_as_key() const {
  assert(last_tick_);
  net::StreamFrame out;
  out.stream_id = stream_id_;
  out.tick = *last_tick_;
  out.vertices = vertices_;
  out.key = key();
  return out;
}

v1::ServerMessage FrameEncoder::header() const {
  v1::ServerMessage message;
  v1::Frame& frame = *message.mutable_frame();
  frame.set_stream_id(stream_id_);
  frame.set_tick(*last_tick_);
  if (scalars_) *frame.mutable_scalars() = *scalars_;
  *frame.mutable_contacts() = contacts_;
  frame.set_layer(layer_);
  return message;
}

void FrameEncoder::add_checks(v1::Frame& frame) const {
  frame.set_check(writer_->check());
  if (velocity_writer_) frame.set_velocities_check(velocity_writer_->check());
}

net::SharedBytes FrameEncoder::key() const {
  v1::ServerMessage message = header();
  v1::Frame& frame = *message.mutable_frame();
  frame.set_layout_id(layout_id_);
  frame.set_time_s(time_s_);
  if (plain_) {
    plain_->write(frame);
  } else {
    writer_->write_key(*frame.mutable_payload());
    if (velocity_writer_) velocity_writer_->write_key(*frame.mutable_velocities());
    add_checks(frame);
  }
  for (std::size_t i = 0; i < poses_.size(); ++i) add_pose(frame, i, poses_[i]);
  return serialise(message);
}

}  // namespace pneuma::app
