#include "app/frame_encoder.h"

#include <cassert>
#include <utility>

#include "app/protocol.h"

namespace pneuma::app {

namespace {

bool same(const physics::Pose& a, const physics::Pose& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

void add_pose(v1::Frame& frame, std::size_t solid, const physics::Pose& pose) {
  v1::Pose& out = *frame.add_poses();
  out.set_solid(static_cast<std::uint32_t>(solid));
  out.mutable_position()->set_x(pose.position.x());
  out.mutable_position()->set_y(pose.position.y());
  out.mutable_position()->set_z(pose.position.z());
  out.mutable_orientation()->set_w(pose.orientation.w());
  out.mutable_orientation()->set_x(pose.orientation.x());
  out.mutable_orientation()->set_y(pose.orientation.y());
  out.mutable_orientation()->set_z(pose.orientation.z());
}

}  // namespace

FrameEncoder::FrameEncoder(std::uint32_t stream_id, double max_error_m)
    : stream_id_(stream_id), max_error_m_(max_error_m) {}

net::StreamFrame FrameEncoder::encode(const FrameSource& source, std::uint64_t tick, const WorldLayout& layout,
                                      std::uint32_t layer, bool with_key) {
  const bool same_layout = writer_ && layout_id_ == layout.id();
  const bool delta = same_layout && last_tick_ && *last_tick_ < tick;
  const std::optional<std::uint64_t> base_tick = last_tick_;
  const std::vector<physics::Pose> base_poses = std::exchange(poses_, source.poses());
  if (!same_layout) writer_.emplace(layout.orders(), max_error_m_);
  last_tick_ = tick;
  layout_id_ = layout.id();
  time_s_ = source.time_s();
  vertices_ = layout.vertex_count();
  layer_ = layer;

  net::StreamFrame out;
  out.stream_id = stream_id_;
  out.tick = tick;
  out.layer = layer;
  out.vertices = vertices_;
  if (delta) {
    out.base_tick = *base_tick;
    v1::ServerMessage message = header();
    v1::Frame& frame = *message.mutable_frame();
    frame.set_base_tick(*base_tick);
    writer_->begin_delta();
    for (std::size_t i = 0; i < source.soft_body_count(); ++i) writer_->move_body(i, positions_of(source, i));
    writer_->take_delta(*frame.mutable_payload());
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      if (!same(poses_[i], base_poses[i])) add_pose(frame, i, poses_[i]);
    }
    out.delta = serialise(message);
  } else {
    for (std::size_t i = 0; i < source.soft_body_count(); ++i) writer_->place_body(i, positions_of(source, i));
  }
  if (with_key || !delta) out.key = key();
  return out;
}

std::span<const double> FrameEncoder::positions_of(const FrameSource& source, std::size_t body) {
  positions_m_.resize(3 * source.mesh(body)->positions_m.size());
  source.copy_positions(body, positions_m_);
  return positions_m_;
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
  frame.set_layout_id(layout_id_);
  frame.set_tick(*last_tick_);
  frame.set_time_s(time_s_);
  frame.set_layer(layer_);
  return message;
}

net::SharedBytes FrameEncoder::key() const {
  v1::ServerMessage message = header();
  v1::Frame& frame = *message.mutable_frame();
  writer_->write_key(*frame.mutable_payload());
  for (std::size_t i = 0; i < poses_.size(); ++i) add_pose(frame, i, poses_[i]);
  return serialise(message);
}

}  // namespace pneuma::app
