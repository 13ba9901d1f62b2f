// The frames of one stream in time layers, of which none builds on a higher one; or all in layer 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "app/frame_encoder.h"

namespace pneuma::app {

/// Every fourth frame is of layer 0, those half-way between of layer 1, the others of layer 2. A frame builds on the
/// last one of a lower layer; of layer 0, on the last one of layer 0.
class LayeredEncoder {
 public:
  static constexpr std::uint64_t cycle = 4;  // frames
  /// Of the frame number `index` of a stream in layers.
  [[nodiscard]] static std::uint32_t layer_of(std::uint64_t index);

  explicit LayeredEncoder(FrameEncoder encoder) : base_(std::move(encoder)) {}

  [[nodiscard]] const FrameContents& contents() const { return base_.contents(); }
  /// Of the last frame of layer 0, which can be had as a key.
  [[nodiscard]] const std::optional<std::uint64_t>& key_tick() const { return base_.last_tick(); }

  /// As FrameEncoder::encode. `with_key` is for layer 0, which the stream begins with.
  [[nodiscard]] net::StreamFrame encode(const FrameSource& source, MeasuredScalars& scalars, std::uint64_t tick,
                                        const WorldLayout& layout, std::uint32_t layer, bool with_key);
  /// What a joiner lacks: the last frame of layer 0 as a key, and the one of layer 1 since then.
  [[nodiscard]] std::vector<net::StreamFrame> for_joiners() const;

 private:
  FrameEncoder base_;  // after the last frame of layer 0
  bool has_middle_ = false;
  std::optional<FrameEncoder> middle_;  // after that of layer 1 since then
  net::StreamFrame middle_frame_;
  std::optional<FrameEncoder> top_;  // of a frame of layer 2; both are kept for their memory
};

}  // namespace pneuma::app
