#include <algorithm>
#include <cassert>
#include <utility>

#include "codec/frame_codec.h"
#include "codec/payload_heads.h"

namespace pneuma::codec {

namespace {

void take_key_block(const MeshOrder& order, const BlockHead& head, MoveScratch& scratch, SymbolReader& symbols,
                    BodyMotion& next) {
  next.weights = take_weights(symbols);
  next.points.resize(3 * order.size());
  scratch.drift.assign(order.size(), Lanes{});
  if (head.mode == BlockMode::plain) {
    for (std::size_t i = 0; i < next.points.size(); ++i) next.points[i] = coordinate_at(head.plain, i);
  } else {
    take_moves(order, head.level, scratch, symbols, next.moves[0]);
    for (std::size_t i = 0; i < next.points.size(); ++i) next.points[i] = head.anchor[i % 3];
    next.move_by(next.moves[0]);
  }
  for (std::size_t k = 0; k < history_size; ++k) {
    if (head.history[k] == level_of_rest) {
      next.moves[k].assign(order.size(), Lanes{});
      continue;
    }
    expect_after(next.moves, k, scratch.drift);
    take_moves(order, head.history[k], scratch, symbols, next.moves[k]);
  }
  if (!head.velocities) return;
  if (*head.velocities == level_of_rest) return take_for_velocities(next.moves[0], next.velocities);
  expect_velocities(next.moves[0], scratch.drift);
  take_moves(order, *head.velocities, scratch, symbols, next.velocities);
  for (Lanes& velocity : next.velocities) velocity = halved(velocity);
}

void take_moved_block(const MeshOrder& order, const BlockHead& head, const BodyMotion& last, MoveScratch& scratch,
                      SymbolReader& symbols, BodyMotion& next) {
  next.weights = head.mode == BlockMode::moved ? take_weights(symbols) : last.weights;
  ring_differences(order, last.moves[0], scratch.ring);
  predict_drift(order, last.moves, next.weights, scratch.ring, scratch.drift);
  take_moves(order, head.level, scratch, symbols, next.moves[0]);
}

void take_simulated_block(const MeshOrder& order, const BlockHead& head, const BodyMotion& last,
                          SimulatedMotion& simulation, MoveScratch& scratch, SymbolReader& symbols, BodyMotion& next) {
  simulation.predict(last.points, last.velocities, scratch.drift);
  take_moves(order, head.level, scratch, symbols, next.moves[0]);
  next.weights = last.weights;
  if (!symbols.failed()) simulation.correct(next.moves[0], next.velocities);
}

/// Makes `next` the body's motion; what it was is left there, for its memory.
void go_on(const BlockHead& head, BodyMotion& motion, BodyMotion& next) {
  if (head.stands_alone()) {
    std::swap(motion, next);
    return;
  }
  motion.age();
  if (head.mode == BlockMode::still) {
    std::ranges::fill(motion.moves[0], Lanes{});
    motion.take_move_for_velocity();
    return;
  }
  motion.weights = next.weights;
  std::swap(motion.moves[0], next.moves[0]);
  motion.move_by(motion.moves[0]);
  if (head.mode == BlockMode::simulated) {
    std::swap(motion.velocities, next.velocities);
  } else {
    motion.take_move_for_velocity();
  }
}

}  // namespace

FrameReader::FrameReader(std::vector<MeshOrderPtr> orders, std::vector<SimulatedMotionPtr> simulations)
    : orders_(std::move(orders)), simulations_(std::move(simulations)) {
  assert(simulations_.empty() || simulations_.size() == orders_.size());
  simulations_.resize(orders_.size());
  digests_.resize(orders_.size());
  for (std::size_t body = 0; body < orders_.size(); ++body) {
    motions_.emplace_back(orders_[body]->size(), simulations_[body] != nullptr);
    next_.emplace_back(0, false);
  }
}

base::Status FrameReader::read(std::string_view payload, bool key) {
  std::vector<BlockBody> bodies;
  bodies.reserve(orders_.size());
  for (std::size_t body = 0; body < orders_.size(); ++body) {
    bodies.push_back({orders_[body]->size(), simulations_[body] != nullptr});
  }
  const auto heads = take_heads(payload, key, bodies);
  if (!heads.ok()) return heads.status();

  words_of(payload, words_);
  if (payload.size() % 2 != 0 || (!payload.empty() && payload.size() < state_count * state_bytes)) {
    return {base::StatusCode::malformed, "the residuals are not a whole number of words", "payload"};
  }
  SymbolReader symbols(words_);
  for (std::size_t body = 0; body < orders_.size(); ++body) {
    const BlockHead& head = (*heads)[body];
    if (head.stands_alone()) {
      take_key_block(*orders_[body], head, scratch_, symbols, next_[body]);
    } else if (head.mode == BlockMode::simulated) {
      take_simulated_block(*orders_[body], head, motions_[body], *simulations_[body], scratch_, symbols, next_[body]);
    } else if (head.mode != BlockMode::still) {
      take_moved_block(*orders_[body], head, motions_[body], scratch_, symbols, next_[body]);
    }
    if (symbols.failed()) return malformed_body(body, "the payload ends in this body's residuals");
  }
  if (!symbols.at_end()) {
    return {base::StatusCode::malformed, "the residuals do not end where the payload does", "payload"};
  }
  for (std::size_t body = 0; body < orders_.size(); ++body) {
    const BlockHead& head = (*heads)[body];
    go_on(head, motions_[body], next_[body]);
    if (head.mode != BlockMode::still) digests_[body] = points_digest(motions_[body].points);
  }
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
