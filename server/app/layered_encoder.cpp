#include "app/layered_encoder.h"

#include <cassert>

namespace pneuma::app {

std::uint32_t LayeredEncoder::layer_of(std::uint64_t index) {
  if (index % cycle == 0) return 0;
  return index % cycle == cycle / 2 ? 1 : 2;
}

net::StreamFrame LayeredEncoder::encode(const FrameSource& source, MeasuredScalars& scalars, std::uint64_t tick,
                                        const WorldLayout& layout, std::uint32_t layer, bool with_key) {
  assert(layer == 0 || base_.last_tick());
  if (layer == 0) {
    has_middle_ = false;
    return base_.encode(source, scalars, tick, layout, 0, with_key);
  }
  if (layer == 1) {
    middle_ = base_;
    has_middle_ = true;
    middle_frame_ = middle_->encode(source, scalars, tick, layout, 1, false);
    return middle_frame_;
  }
  top_ = has_middle_ ? *middle_ : base_;
  return top_->encode(source, scalars, tick, layout, 2, false);
}

std::vector<net::StreamFrame> LayeredEncoder::for_joiners() const {
  std::vector<net::StreamFrame> frames{base_.last_as_key()};
  if (has_middle_) frames.push_back(middle_frame_);
  return frames;
}

}  // namespace pneuma::app
