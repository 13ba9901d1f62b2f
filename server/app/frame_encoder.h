// The frames of one stream: what they hold, and what the next one builds on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/frame_source.h"
#include "app/layout.h"
#include "app/plain_numbers.h"
#include "codec/frame_codec.h"
#include "net/server.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// The scalars of a source's bodies, each measured once for all streams that want it.
class MeasuredScalars {
 public:
  explicit MeasuredScalars(const FrameSource& source) : source_(source) {}
  /// Nothing where the source has none.
  [[nodiscard]] const std::optional<BodyScalars>& of(std::size_t body);

 private:
  const FrameSource& source_;
  std::vector<std::optional<BodyScalars>> measured_;  // empty before the first is asked for
};

/// What the frames of a stream hold.
struct FrameContents {
  double max_error_m;
  double tick_s;                        // by which readers reckon the time of a frame that does not tell it
  double max_velocity_error_m_s = 0.0;  // with velocities
  bool velocities = false;
  bool scalars = false;
  bool contacts = false;
  bool plain = false;  // numbers as they are, in key frames alone; errors of 0: as near as a float is
};

class FrameEncoder {
 public:
  FrameEncoder(std::uint32_t stream_id, const FrameContents& contents);

  [[nodiscard]] const FrameContents& contents() const { return contents_; }
  [[nodiscard]] const std::optional<std::uint64_t>& last_tick() const { return last_tick_; }

  /// Takes the source's state as the stream's next frame; `scalars` are of the same source. The delta is there where
  /// the frame before had the same layout and an earlier tick; the key where there is no delta, or `with_key` is set.
  [[nodiscard]] net::StreamFrame encode(const FrameSource& source, MeasuredScalars& scalars, std::uint64_t tick,
                                        const WorldLayout& layout, std::uint32_t layer, bool with_key);
  /// The last frame once more, as a key. Only after encode().
  [[nodiscard]] net::StreamFrame last_as_key() const;

 private:
  using Copy = void (FrameSource::*)(std::size_t, std::span<double>) const;

  void begin_layout(const FrameSource& source, const WorldLayout& layout);
  /// A delta goes to `payload`; null: the stream begins anew.
  void write(const FrameSource& source, Copy copy, const WorldLayout& layout, codec::FrameWriter& writer,
             std::string* payload);
  void take_plain(const FrameSource& source, const WorldLayout& layout);
  /// Fills numbers_ with those of all bodies.
  void gather(const FrameSource& source, Copy copy, const WorldLayout& layout);
  std::span<const double> vectors_of(const FrameSource& source, Copy copy, const WorldLayout::Body& body);
  void take_scalars(MeasuredScalars& scalars, const WorldLayout& layout);
  /// What delta and key frames have in common.
  [[nodiscard]] v1::ServerMessage header() const;
  /// By which readers see that they hold the last frame.
  void add_checks(v1::Frame& frame) const;
  [[nodiscard]] net::SharedBytes key() const;

  std::uint32_t stream_id_;
  FrameContents contents_;

  // The last frame:
  std::optional<std::uint64_t> last_tick_;
  std::uint32_t layout_id_ = 0;
  double time_s_ = 0.0;  // as its readers have it
  std::uint32_t layer_ = 0;
  std::size_t vertices_ = 0;
  std::optional<codec::FrameWriter> writer_;
  std::optional<codec::FrameWriter> velocity_writer_;
  std::optional<v1::Scalars> scalars_;
  google::protobuf::RepeatedPtrField<v1::Contact> contacts_;
  std::vector<physics::Pose> poses_;  // rigid bodies, then colliders

  std::optional<PlainFrame> plain_;  // of a plain stream, in place of the writers

  std::vector<double> vectors_;  // of a body; kept for its memory
  std::vector<double> numbers_;  // of all bodies; likewise
};

}  // namespace pneuma::app
