#include "codec/prediction_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace pneuma::codec {

namespace {

constexpr std::size_t samples_max = 96;
constexpr std::size_t term_count = 4;

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
  Observer(const MeshOrder& order, const std::vector<Lanes>& moves, const std::vector<Lanes>& move,
           const std::vector<Lanes>& move_before)
      : order_(order), moves_(moves), move_(move), move_before_(move_before) {}

  [[nodiscard]] Observation at(std::size_t slot) const {
    LaneVector ring = {};
    LaneVector ring_before = {};
    const std::uint32_t begin = order_.ring_begins[slot];
    const std::uint32_t end = std::min(order_.ring_begins[slot + 1], begin + 64);
    for (std::uint32_t i = begin; i < end; ++i) {
      ring += move_[order_.rings[i]].v - move_[slot].v;
      ring_before += move_before_[order_.rings[i]].v - move_before_[slot].v;
    }
    return {to_float(moves_[slot].v),
            {to_float(move_[slot].v), to_float(move_before_[slot].v), to_float(ring), to_float(ring_before)}};
  }

 private:
  const MeshOrder& order_;
  const std::vector<Lanes>& moves_;
  const std::vector<Lanes>& move_;
  const std::vector<Lanes>& move_before_;
};

/// Normal equations of a move on its terms.
struct Normal {
  std::array<std::array<double, term_count>, term_count> terms{};
  std::array<double, term_count> move{};
  double squares = 0.0;

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
  }

  [[nodiscard]] std::array<double, term_count> solved() const;
  /// What is left of the squares with these weights.
  [[nodiscard]] double left(const std::array<double, term_count>& weights) const {
    double sum = squares;
    for (std::size_t i = 0; i < term_count; ++i) {
      sum -= 2.0 * weights[i] * move[i];
      for (std::size_t j = 0; j < term_count; ++j) {
        sum += weights[i] * weights[j] * (j <= i ? terms[i][j] : terms[j][i]);
      }
    }
    return sum;
  }
};

/// By Cholesky's factors; a term that says nothing new gets no weight.
std::array<double, term_count> Normal::solved() const {
  std::array<std::array<double, term_count>, term_count> factor{};
  std::array<double, term_count> answer{};
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

std::int8_t as_weight(double value, double unit) {
  return static_cast<std::int8_t>(std::clamp(std::lround(value / unit), -128L, 127L));
}

}  // namespace

Predictor fit_predictor(const MeshOrder& order, const std::vector<Lanes>& moves, const std::vector<Lanes>& move,
                        const std::vector<Lanes>& move_before) {
  const Observer observer(order, moves, move, move_before);
  std::array<Normal, 3> normals;
  const std::size_t stride = (order.size() + samples_max - 1) / samples_max;
  for (std::size_t slot = stride / 2; stride > 0 && slot < order.size(); slot += stride) {
    const Observation alone = observer.at(slot);
    normals[static_cast<std::size_t>(Neighbours::ignored)].add(alone);
    Observation mean = alone;
    for (const std::uint32_t parent : order.parents[slot]) {
      if (parent != 0) mean.add(-0.25F, observer.at(parent - 1));
    }
    normals[static_cast<std::size_t>(Neighbours::mean)].add(mean);
    Observation parallelogram = alone;
    for (std::size_t i = 0; i < 6; ++i) {
      const std::uint32_t corner = order.parallelograms[slot][i];
      if (corner != 0) parallelogram.add(i < 4 ? -0.5F : 0.5F, observer.at(corner - 1));
    }
    normals[static_cast<std::size_t>(Neighbours::parallelogram)].add(parallelogram);
  }

  Predictor best;
  double least = 0.0;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const auto solved = normals[i].solved();
    const double left = normals[i].left(solved);
    if (i > 0 && !(left < least)) continue;
    least = left;
    best = {static_cast<Neighbours>(i),
            {as_weight(solved[0], move_weight_unit), as_weight(solved[1], move_weight_unit),
             as_weight(solved[2], ring_weight_unit), as_weight(solved[3], ring_weight_unit)}};
  }
  return best;
}

}  // namespace pneuma::codec
