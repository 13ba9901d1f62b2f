#include <algorithm>
#include <cassert>
#include <utility>

#include "codec/frame_codec.h"
#include "codec/payload_heads.h"

namespace pneuma::codec {

namespace {

std::int64_t sum(std::int64_t point, std::uint32_t move) {
  const auto far = static_cast<std::int64_t>(static_cast<std::int32_t>(move));
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(point) + static_cast<std::uint64_t>(far));
}

void take_own_moves(const MeshOrder& order, std::uint8_t level, MoveScratch& scratch, SymbolReader& symbols,
                    std::vector<Lanes>& moves) {
  if (level == level_of_rest) {
    moves.assign(order.size(), Lanes{});
  } else {
    take_moves(order, Neighbours::mean, level, scratch, symbols, moves);
  }
}

void take_key_block(const MeshOrder& order, const BlockHead& head, MoveScratch& scratch, SymbolReader& symbols,
                    BodyMotion& next) {
  next.points.resize(3 * order.size());
  scratch.drift.assign(order.size(), Lanes{});
  if (head.mode == BlockMode::plain) {
    for (std::size_t i = 0; i < next.points.size(); ++i) next.points[i] = coordinate_at(head.plain, i);
  } else {
    take_moves(order, Neighbours::parallelogram, head.level, scratch, symbols, next.move);
    for (std::size_t i = 0; i < next.points.size(); ++i) {
      next.points[i] = sum(head.anchor[i % 3], next.move[i / 3].v[i % 3]);
    }
  }
  take_own_moves(order, head.move_level, scratch, symbols, next.move);
  predict_drift(order, next.move, next.move, steady_motion, scratch.ring, scratch.drift);
  take_own_moves(order, head.before_level, scratch, symbols, next.move_before);
}

void take_moved_block(const MeshOrder& order, const BlockHead& head, const BodyMotion& last, MoveScratch& scratch,
                      SymbolReader& symbols, BodyMotion& next) {
  predict_drift(order, last.move, last.move_before, head.weights, scratch.ring, scratch.drift);
  take_moves(order, head.neighbours(), head.level, scratch, symbols, next.move);
  next.points.resize(last.points.size());
  for (std::size_t slot = 0; slot < order.size(); ++slot) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      next.points[3 * slot + axis] = sum(last.points[3 * slot + axis], next.move[slot].v[axis]);
    }
  }
}

/// Makes `next` the body's motion; what it was is left there, for its memory.
void go_on(const BlockHead& head, BodyMotion& motion, BodyMotion& next) {
  if (head.stands_alone()) {
    std::swap(motion, next);
    return;
  }
  std::swap(motion.move_before, motion.move);
  if (head.mode == BlockMode::still) {
    std::ranges::fill(motion.move, Lanes{});
  } else {
    std::swap(motion.move, next.move);
    std::swap(motion.points, next.points);
  }
}

}  // namespace

FrameReader::FrameReader(std::vector<MeshOrderPtr> orders) : orders_(std::move(orders)) {
  for (const MeshOrderPtr& order : orders_) {
    motions_.emplace_back(order->size());
    next_.emplace_back(0);
  }
}

base::Status FrameReader::read(std::string_view payload, bool key) {
  std::vector<std::size_t> vertex_counts;
  vertex_counts.reserve(orders_.size());
  for (const MeshOrderPtr& order : orders_) vertex_counts.push_back(order->size());
  const auto heads = take_heads(payload, key, vertex_counts);
  if (!heads.ok()) return heads.status();

  const std::vector<std::uint16_t> words = words_of(payload);
  if (payload.size() % 2 != 0 || (!payload.empty() && payload.size() < 2 * state_bytes)) {
    return {base::StatusCode::malformed, "the residuals are not a whole number of words", "payload"};
  }
  SymbolReader symbols(words);
  for (std::size_t body = 0; body < orders_.size(); ++body) {
    const BlockHead& head = (*heads)[body];
    if (head.stands_alone()) {
      take_key_block(*orders_[body], head, scratch_, symbols, next_[body]);
    } else if (head.mode != BlockMode::still) {
      take_moved_block(*orders_[body], head, motions_[body], scratch_, symbols, next_[body]);
    }
    if (symbols.failed()) return malformed_body(body, "the payload ends in this body's residuals");
  }
  if (!symbols.at_end()) {
    return {base::StatusCode::malformed, "the residuals do not end where the payload does", "payload"};
  }
  for (std::size_t body = 0; body < orders_.size(); ++body) go_on((*heads)[body], motions_[body], next_[body]);
  return {};
}

void FrameReader::points(std::size_t body, std::span<std::int64_t> out) const {
  const MeshOrder& order = *orders_[body];
  assert(out.size() == 3 * order.size());
  for (std::size_t slot = 0; slot < order.size(); ++slot) {
    const std::int64_t* const from = motions_[body].points.data() + 3 * slot;
    std::int64_t* const to = out.data() + 3 * std::size_t{order.vertices[slot]};
    for (std::size_t axis = 0; axis < 3; ++axis) to[axis] = from[axis];
  }
}

void FrameReader::positions(std::size_t body, double step_m, std::span<double> out_m) const {
  const MeshOrder& order = *orders_[body];
  assert(out_m.size() == 3 * order.size());
  for (std::size_t slot = 0; slot < order.size(); ++slot) {
    const std::size_t to = 3 * std::size_t{order.vertices[slot]};
    dequantise(std::span(motions_[body].points).subspan(3 * slot, 3), step_m, out_m.subspan(to, 3));
  }
}

}  // namespace pneuma::codec
