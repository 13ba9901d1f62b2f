#include "codec/prediction_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace pneuma::codec {

namespace {

constexpr std::size_t samples_max = 192;
constexpr std::size_t term_count = 2 * history_size + 1;

using Weights = std::array<double, term_count>;
using FloatLanes [[gnu::vector_size(16)]] = float;

FloatLanes to_float(LaneVector lanes) {
  return __builtin_convertvector(std::bit_cast<SignedLaneVector>(lanes), FloatLanes);
}

/// What happened at a slot: its move, and the terms of its drift.
struct Observation {
  FloatLanes move = {};
  std::array<FloatLanes, term_count> terms = {};

  void add(float factor, const Observation& other) {
    move += factor * other.move;
    for (std::size_t i = 0; i < term_count; ++i) terms[i] += factor * other.terms[i];
  }
};

class Observer {
 public:
  Observer(const MeshOrder& order, const std::vector<Lanes>& moves, const MoveHistory& history)
      : order_(order), moves_(moves), history_(history), ring_(order.size()) {
    for (std::size_t slot = 0; slot < order.size(); ++slot) {
      ring_[slot].v = ring_difference(order, slot, history[0].data());
    }
  }

  [[nodiscard]] Observation at(std::size_t slot) const {
    Observation seen{to_float(moves_[slot].v), {}};
    for (std::size_t k = 0; k < history_size; ++k) {
      seen.terms[k] = to_float(history_[k][slot].v);
      seen.terms[history_size + k] = to_float(ring_difference(order_, slot, history_[k].data()));
    }
    seen.terms[2 * history_size] = to_float(ring_difference(order_, slot, ring_.data()));
    return seen;
  }

 private:
  const MeshOrder& order_;
  const std::vector<Lanes>& moves_;
  const MoveHistory& history_;
  std::vector<Lanes> ring_;
};

/// Normal equations of a move on its terms.
struct Normal {
  std::array<std::array<double, term_count>, term_count> terms{};
  std::array<double, term_count> move{};
  double squares = 0.0;
  std::size_t samples = 0;

  void add(const Observation& seen) {
    const auto dot = [](FloatLanes a, FloatLanes b) {
      const FloatLanes product = a * b;
      return static_cast<double>(product[0] + product[1] + product[2]);
    };
    for (std::size_t i = 0; i < term_count; ++i) {
      for (std::size_t j = 0; j <= i; ++j) terms[i][j] += dot(seen.terms[i], seen.terms[j]);
      move[i] += dot(seen.terms[i], seen.move);
    }
    squares += dot(seen.move, seen.move);
    ++samples;
  }

  [[nodiscard]] Weights solved() const;
  /// What is left of the squares with these weights, a sample.
  [[nodiscard]] double left(const Weights& weights) const {
    double sum = squares;
    for (std::size_t i = 0; i < term_count; ++i) {
      sum -= 2.0 * weights[i] * move[i];
      for (std::size_t j = 0; j < term_count; ++j) {
        sum += weights[i] * weights[j] * (j <= i ? terms[i][j] : terms[j][i]);
      }
    }
    return sum / static_cast<double>(samples);
  }
};

/// By Cholesky's factors; a term that says nothing new gets no weight.
Weights Normal::solved() const {
  std::array<std::array<double, term_count>, term_count> factor{};
  Weights answer{};
  std::array<bool, term_count> used{};
  for (std::size_t i = 0; i < term_count; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double rest = terms[i][j];
      for (std::size_t k = 0; k < j; ++k) rest -= factor[i][k] * factor[j][k];
      if (i != j) {
        factor[i][j] = used[j] ? rest / factor[j][j] : 0.0;
      } else if (rest > 1e-6 * terms[i][i] && rest > 0.0) {
        used[i] = true;
        factor[i][i] = std::sqrt(rest);
      }
    }
    double rest = move[i];
    for (std::size_t k = 0; k < i; ++k) rest -= factor[i][k] * answer[k];
    answer[i] = used[i] ? rest / factor[i][i] : 0.0;
  }
  for (std::size_t i = term_count; i-- > 0;) {
    if (!used[i]) continue;
    for (std::size_t k = i + 1; k < term_count; ++k) answer[i] -= factor[k][i] * answer[k];
    answer[i] /= factor[i][i];
  }
  return answer;
}

std::int32_t as_weight(double value, double unit) {
  // As much as no fit needs.
  constexpr double weight_max = 64.0;
  return static_cast<std::int32_t>(std::lround(std::clamp(value, -weight_max, weight_max) / unit));
}

DriftWeights in_units(const Weights& weights) {
  DriftWeights rounded;
  for (std::size_t k = 0; k < history_size; ++k) {
    rounded.own[k] = as_weight(weights[k], own_weight_unit);
    rounded.ring[k] = as_weight(weights[history_size + k], ring_weight_unit);
  }
  rounded.ring_of_ring = as_weight(weights[2 * history_size], ring_weight_unit);
  return rounded;
}

Weights from_units(const DriftWeights& rounded) {
  Weights weights{};
  for (std::size_t k = 0; k < history_size; ++k) {
    weights[k] = own_weight_unit * rounded.own[k];
    weights[history_size + k] = ring_weight_unit * rounded.ring[k];
  }
  weights[2 * history_size] = ring_weight_unit * rounded.ring_of_ring;
  return weights;
}

Normal observe(const MeshOrder& order, const std::vector<Lanes>& moves, const MoveHistory& history) {
  const Observer observer(order, moves, history);
  Normal normal;
  const std::size_t stride = (order.size() + samples_max - 1) / samples_max;
  for (std::size_t slot = stride / 2; stride > 0 && slot < order.size(); slot += stride) {
    const MeshOrder::Parents& parents = order.parents[slot];
    Observation seen = observer.at(slot);
    for (std::size_t i = 0; i < parents.count; ++i) {
      seen.add(-1.0F / static_cast<float>(parents.count), observer.at(parents.slots[i] - 1));
    }
    normal.add(seen);
  }
  return normal;
}

}  // namespace

std::optional<DriftWeights> better_weights(const MeshOrder& order, const std::vector<Lanes>& moves,
                                           const MoveHistory& history, const DriftWeights& last) {
  // What weights take in a frame, and what is left of any vertex by the rounding of points.
  constexpr double weights_bits = 110.0;
  constexpr double noise = 1.5;
  const Normal normal = observe(order, moves, history);
  const DriftWeights fitted = in_units(normal.solved());
  const double gain = (normal.left(from_units(last)) + noise) / (normal.left(from_units(fitted)) + noise);
  if (!(1.5 * static_cast<double>(order.size()) * std::log2(gain) > weights_bits)) return std::nullopt;
  return fitted;
}

}  // namespace pneuma::codec
