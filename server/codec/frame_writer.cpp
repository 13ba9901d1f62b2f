#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "codec/frame_codec.h"
#include "codec/payload_heads.h"
#include "codec/prediction_fit.h"

namespace pneuma::codec {

namespace {

// What a move may be; a vertex that goes further in a frame begins anew.
constexpr std::int64_t move_max = std::int64_t{1} << 30;

// What a vertex takes more where all residuals are a level, a quarter octave, larger.
constexpr double bits_a_level = 3 * 0.25;

/// Sets `out` to points less a point for each, where every difference is a move. False where one is not.
template <class Origin>
bool subtract(const Lattice& points, Origin&& origin_of, std::vector<Lanes>& out) {
  const std::size_t count = points.size() / 3;
  out.resize(count);
  std::uint64_t too_far = 0;
  for (std::size_t slot = 0; slot < count; ++slot) {
    const std::int64_t* const origin = origin_of(slot);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t difference = points[3 * slot + axis] - origin[axis];
      too_far |= static_cast<std::uint64_t>(difference + move_max) >> 31;
      out[slot].v[axis] = static_cast<std::uint32_t>(difference);
    }
  }
  return too_far == 0;
}

bool all_zero(const std::vector<Lanes>& moves) {
  LaneVector any = {};
  for (const Lanes& move : moves) any |= move.v;
  return (any[0] | any[1] | any[2]) == 0;
}

std::uint8_t put_velocities(const MeshOrder& order, const BodyMotion& motion, MoveScratch& scratch,
                            std::vector<Triple>& triples) {
  std::vector<Lanes> velocities;
  take_for_velocities(motion.moves[0], velocities);
  if (velocities == motion.velocities) return level_of_rest;
  for (std::size_t slot = 0; slot < velocities.size(); ++slot) velocities[slot] = doubled(motion.velocities[slot]);
  expect_velocities(motion.moves[0], scratch.drift);
  return static_cast<std::uint8_t>(put_moves(order, velocities, scratch, triples));
}

/// A block that stands alone: the points, and the last moves, each expected to be like the one after it.
void put_key_block(const MeshOrder& order, const BodyMotion& motion, MoveScratch& scratch, std::string& heads,
                   std::vector<Triple>& triples) {
  BlockHead head;
  std::string plain;
  std::vector<Lanes> from_anchor;
  const std::int64_t* const anchor = motion.points.data();
  const auto anchor_of = [anchor](std::size_t) { return anchor; };
  put_weights(motion.weights, triples);
  scratch.drift.assign(order.size(), Lanes{});
  if (order.size() > 0 && subtract(motion.points, anchor_of, from_anchor)) {
    head.mode = BlockMode::key;
    head.anchor = {anchor[0], anchor[1], anchor[2]};
    head.level = static_cast<std::uint8_t>(put_moves(order, from_anchor, scratch, triples));
  } else {
    head.mode = BlockMode::plain;
    for (const std::int64_t coordinate : motion.points) append_coordinate(coordinate, plain);
    head.plain = plain;
  }
  for (std::size_t k = 0; k < history_size; ++k) {
    if (all_zero(motion.moves[k])) continue;
    expect_after(motion.moves, k, scratch.drift);
    head.history[k] = static_cast<std::uint8_t>(put_moves(order, motion.moves[k], scratch, triples));
  }
  if (!motion.velocities.empty()) head.velocities = put_velocities(order, motion, scratch, triples);
  append_head(head, heads);
}

}  // namespace

FrameWriter::FrameWriter(std::vector<MeshOrderPtr> orders, double max_error_m,
                         std::vector<SimulatedMotionPtr> simulations)
    : orders_(std::move(orders)),
      simulations_(std::move(simulations)),
      step_m_(codec::grid_step_m(max_error_m)),
      within_m_(surely_within_m(max_error_m)),
      digests_(orders_.size()),
      rings_lag_(orders_.size()),
      trusts_(orders_.size()) {
  assert(simulations_.empty() || simulations_.size() == orders_.size());
  simulations_.resize(orders_.size());
  motions_.reserve(orders_.size());
  for (std::size_t body = 0; body < orders_.size(); ++body) {
    motions_.emplace_back(orders_[body]->size(), simulations_[body] != nullptr);
    rings_.emplace_back(orders_[body]->size());
  }
}

void FrameWriter::gather(const MeshOrder& order, std::span<const double> positions_m) {
  assert(positions_m.size() == 3 * order.size());
  positions_m_.resize(positions_m.size());
  points_.resize(positions_m.size());
  for (std::size_t slot = 0; slot < order.size(); ++slot) {
    const double* const from = positions_m.data() + 3 * std::size_t{order.vertices[slot]};
    double* const to = positions_m_.data() + 3 * slot;
    for (std::size_t axis = 0; axis < 3; ++axis) to[axis] = from[axis];
  }
}

bool FrameWriter::is_still(const Lattice& points) const {
  for (std::size_t i = 0; i < points.size(); i += 3) {
    double squares = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double off = positions_m_[i + axis] - static_cast<double>(points[i + axis]) * step_m_;
      squares += off * off;
    }
    if (squares > within_m_ * within_m_) return false;
  }
  return true;
}

void FrameWriter::begin_delta() {
  heads_.clear();
}

void FrameWriter::move_body(std::size_t body, std::span<const double> positions_m) {
  const MeshOrder& order = *orders_[body];
  BodyMotion& motion = motions_[body];
  gather(order, positions_m);
  if (is_still(motion.points)) {
    append_head({}, heads_);
    motion.age();
    std::ranges::fill(motion.moves[0], Lanes{});
    motion.take_move_for_velocity();
    note_moves(body);
    return;
  }
  quantise(positions_m_, step_m_, points_);
  const auto last_point = [&motion](std::size_t slot) { return motion.points.data() + 3 * slot; };
  if (!subtract(points_, last_point, moves_)) {
    std::swap(motion.points, points_);
    digests_[body] = points_digest(motion.points);
    motion.come_to_rest();
    rings_[body] = RingHistory(order.size());
    trusts_[body] = {};
    rings_lag_[body] = 0;
    put_key_block(order, motion, scratch_, heads_, triples_);
    return;
  }
  alternatives_.resize(order.size());
  find_alternatives(positions_m_, points_, step_m_, within_m_, alternatives_);
  const BlockHead head = simulations_[body] != nullptr ? put_better(body) : put_moved(body);
  append_head(head, heads_);
  motion.move_by(moves_);
  digests_[body] = points_digest(motion.points);
  motion.age();
  std::swap(motion.moves[0], moves_);
  if (head.mode == BlockMode::simulated) {
    simulations_[body]->correct(motion.moves[0], motion.velocities);
    rings_lag_[body] = 1;
  } else {
    motion.take_move_for_velocity();
    note_moves(body);
  }
}

/// Puts moves_ against those that the motions before lead to.
BlockHead FrameWriter::put_moved(std::size_t body) {
  const MeshOrder& order = *orders_[body];
  BodyMotion& motion = motions_[body];
  catch_up_rings(body);
  BlockHead head;
  head.mode = BlockMode::again;
  const RingHistory& rings = rings_[body];
  if (const auto better = better_weights(order, moves_, motion.moves, rings, motion.weights)) {
    motion.weights = *better;
    head.mode = BlockMode::moved;
    put_weights(motion.weights, triples_);
  }
  scratch_.ring = rings.of_moves[0];
  predict_drift(order, motion.moves, motion.weights, scratch_.ring, scratch_.drift);
  head.level = static_cast<std::uint8_t>(put_either(order, alternatives_, scratch_, moves_, triples_));
  return head;
}

/// Puts moves_ against those that the body's mechanics lead to.
std::uint8_t FrameWriter::put_simulated(std::size_t body) {
  const BodyMotion& motion = motions_[body];
  simulations_[body]->predict(motion.points, motion.velocities, scratch_.drift);
  return static_cast<std::uint8_t>(put_either(*orders_[body], alternatives_, scratch_, moves_, triples_));
}

/// By its mechanics, or by its moves where trust in these has to be earned and they leave less.
BlockHead FrameWriter::put_better(std::size_t body) {
  const std::size_t triples_before = triples_.size();
  unexpected_moves_ = moves_;
  BlockHead head;
  head.mode = BlockMode::simulated;
  head.level = put_simulated(body);
  if (trusts_[body].take_unseen(head.level)) return head;
  std::swap(moves_, unexpected_moves_);
  simulated_triples_.assign(triples_.begin() + static_cast<std::ptrdiff_t>(triples_before), triples_.end());
  triples_.resize(triples_before);
  const DriftWeights weights = motions_[body].weights;
  const BlockHead other = put_moved(body);
  const double weights_levels =
      other.mode == BlockMode::moved ? weights_bits / (bits_a_level * static_cast<double>(moves_.size())) : 0.0;
  if (!trusts_[body].take(head.level, other.level + weights_levels)) return other;
  std::swap(moves_, unexpected_moves_);
  triples_.resize(triples_before);
  triples_.insert(triples_.end(), simulated_triples_.begin(), simulated_triples_.end());
  motions_[body].weights = weights;
  return head;
}

void FrameWriter::catch_up_rings(std::size_t body) {
  if (std::exchange(rings_lag_[body], 0) == 0) return;
  RingHistory& rings = rings_[body];
  for (std::size_t k = 0; k < history_size; ++k) {
    ring_differences(*orders_[body], motions_[body].moves[k], rings.of_moves[k]);
  }
  ring_differences(*orders_[body], rings.of_moves[0], rings.of_ring);
}

void FrameWriter::note_moves(std::size_t body) {
  if (rings_lag_[body] != 0) return;
  RingHistory& rings = rings_[body];
  std::ranges::rotate(rings.of_moves, rings.of_moves.end() - 1);
  ring_differences(*orders_[body], motions_[body].moves[0], rings.of_moves[0]);
  ring_differences(*orders_[body], rings.of_moves[0], rings.of_ring);
}

void FrameWriter::take_delta(std::string& payload) {
  payload.push_back(static_cast<char>(payload_format));
  payload.append(heads_);
  symbols_.write(triples_, payload);
  triples_.clear();
}

void FrameWriter::place_body(std::size_t body, std::span<const double> positions_m) {
  BodyMotion& motion = motions_[body];
  gather(*orders_[body], positions_m);
  quantise(positions_m_, step_m_, motion.points);
  digests_[body] = points_digest(motion.points);
  motion.come_to_rest();
  rings_[body] = RingHistory(motion.moves[0].size());
  trusts_[body] = {};
  rings_lag_[body] = 0;
}

void FrameWriter::write_key(std::string& payload) const {
  std::string heads;
  std::vector<Triple> triples;
  MoveScratch scratch;
  for (std::size_t body = 0; body < orders_.size(); ++body) {
    put_key_block(*orders_[body], motions_[body], scratch, heads, triples);
  }
  payload.push_back(static_cast<char>(payload_format));
  payload.append(heads);
  SymbolWriter().write(triples, payload);
}

}  // namespace pneuma::codec
