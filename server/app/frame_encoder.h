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
#include "codec/frame_codec.h"
#include "net/server.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

class FrameEncoder {
 public:
  FrameEncoder(std::uint32_t stream_id, double max_error_m);

  [[nodiscard]] double grid_step_m() const { return codec::grid_step_m(max_error_m_); }
  [[nodiscard]] const std::optional<std::uint64_t>& last_tick() const { return last_tick_; }

  /// Takes the source's positions as the stream's next frame. The delta is there where the frame before had the same
  /// layout and an earlier tick; the key where there is no delta, or `with_key` is set.
  [[nodiscard]] net::StreamFrame encode(const FrameSource& source, std::uint64_t tick, const WorldLayout& layout,
                                        std::uint32_t layer, bool with_key);
  /// The last frame once more, as a key. Only after encode().
  [[nodiscard]] net::StreamFrame last_as_key() const;

 private:
  std::span<const double> positions_of(const FrameSource& source, std::size_t body);
  [[nodiscard]] v1::ServerMessage header() const;
  [[nodiscard]] net::SharedBytes key() const;

  std::uint32_t stream_id_;
  double max_error_m_;

  // The last frame:
  std::optional<std::uint64_t> last_tick_;
  std::uint32_t layout_id_ = 0;
  double time_s_ = 0.0;
  std::uint32_t layer_ = 0;
  std::size_t vertices_ = 0;
  std::optional<codec::FrameWriter> writer_;
  std::vector<physics::Pose> poses_;  // rigid bodies, then colliders

  std::vector<double> positions_m_;  // of a body; kept for its memory
};

}  // namespace pneuma::app
