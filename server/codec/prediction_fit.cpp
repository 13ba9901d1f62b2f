#include "codec/prediction_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "codec/clones.h"

namespace pneuma::codec {

namespace {

// One vertex in so many, within bounds. Twice as many save nothing, half as many cost 0.06 to 0.2 bit a vertex.
constexpr std::size_t vertices_a_sample = 8;
constexpr std::size_t samples_min = 64;
constexpr std::size_t samples_max = 192;
constexpr std::size_t term_count = 2 * history_size + 1;
constexpr std::size_t row_count = term_count + 1;  // and the move itself

using Weights = std::array<double, term_count>;

// By their axes; the fourth is of nothing, and left out of what is added up. Moves of one motion are near to each
// other: in single precision, sums of their squares say little about what they differ in.
using DoubleLanes [[gnu::vector_size(32)]] = double;

DoubleLanes widened(LaneVector lanes) {
  return __builtin_convertvector(std::bit_cast<SignedLaneVector>(lanes), DoubleLanes);
}

/// What happened at some slots against what happened at their parents, which is what coding will see: the terms of
/// their drifts, and their moves. Each counts in inverse proportion to how far off `last` leaves it, a step towards the
/// least sum of distances: of the squares themselves, a few vertices that hit something would decide for all. That
/// saves 1 to 5 % of a frame.
class Samples {
 public:
  Samples(const MeshOrder& order, const std::vector<Lanes>& moves, const MoveHistory& history, const RingHistory& rings,
          const Weights& last) {
    std::array<const Lanes*, row_count> fields{};
    for (std::size_t k = 0; k < history_size; ++k) {
      fields[k] = history[k].data();
      fields[history_size + k] = rings.of_moves[k].data();
    }
    fields[2 * history_size] = rings.of_ring.data();
    fields[term_count] = moves.data();
    const std::size_t samples = std::clamp(order.size() / vertices_a_sample, samples_min, samples_max);
    const std::size_t stride = (order.size() + samples - 1) / samples;
    for (std::size_t slot = stride / 2; stride > 0 && slot < order.size(); slot += stride) {
      const MeshOrder::Parents& parents = order.parents[slot];
      if (parents.count > 0) rows_[count_++] = rows_at(slot, parents, fields);
    }
    weigh(last);
  }

  /// What the samples count, all together.
  [[nodiscard]] double weight() const { return weight_; }
  /// Of row `a` with each row up to it, added up over the samples.
  template <std::size_t a>
  [[nodiscard]] std::array<double, a + 1> products() const {
    std::array<DoubleLanes, a + 1> sums{};
    for (std::size_t i = 0; i < count_; ++i) {
      for (std::size_t b = 0; b <= a; ++b) sums[b] += rows_[i][a] * rows_[i][b];
    }
    std::array<double, a + 1> totals{};
    for (std::size_t b = 0; b <= a; ++b) totals[b] = sums[b][0] + sums[b][1] + sums[b][2];
    return totals;
  }

 private:
  using Rows = std::array<DoubleLanes, row_count>;

  static Rows rows_at(std::size_t slot, const MeshOrder::Parents& parents,
                      const std::array<const Lanes*, row_count>& fields) {
    // As many for every slot, itself where there are fewer: a loop over their number would be guessed wrong too often.
    std::array<std::size_t, parents_max> at{};
    for (std::size_t i = 0; i < parents_max; ++i) at[i] = parents.slots[i] > 0 ? parents.slots[i] - 1 : slot;
    const auto spare = static_cast<std::uint32_t>(parents_max) - parents.count;
    const double factor = 1.0 / parents.count;
    Rows rows;
    for (std::size_t row = 0; row < row_count; ++row) {
      const Lanes* const field = fields[row];
      const LaneVector own = field[slot].v;
      LaneVector sum = field[at[0]].v;
      for (std::size_t i = 1; i < parents_max; ++i) sum += field[at[i]].v;
      rows[row] = widened(own) - factor * widened(sum - spare * own);
    }
    return rows;
  }

  void weigh(const Weights& last) {
    // Of two steps: nothing is predicted much closer than the grid is fine.
    constexpr double finest_square = 4.0;
    for (std::size_t i = 0; i < count_; ++i) {
      Rows& rows = rows_[i];
      DoubleLanes off = rows[term_count];
      for (std::size_t term = 0; term < term_count; ++term) off -= last[term] * rows[term];
      const DoubleLanes squares = off * off;
      const double size = std::sqrt(finest_square + (squares[0] + squares[1] + squares[2]));
      const double root = 1.0 / std::sqrt(size);
      for (DoubleLanes& row : rows) row *= root;
      weight_ += root * root;
    }
  }

  std::array<Rows, samples_max> rows_;
  std::size_t count_ = 0;
  double weight_ = 0.0;
};

/// Normal equations of a move on its terms.
struct Normal {
  std::array<std::array<double, term_count>, term_count> terms{};  // the lower triangle
  std::array<double, term_count> move{};
  double squares = 0.0;
  double sample_weight = 0.0;  // of all samples

  explicit Normal(const Samples& seen) : sample_weight(seen.weight()) {
    const auto take_terms = [&]<std::size_t... i>(std::index_sequence<i...>) {
      (std::ranges::copy(seen.products<i>(), terms[i].begin()), ...);
    };
    take_terms(std::make_index_sequence<term_count>());
    const auto with_move = seen.products<term_count>();
    std::ranges::copy_n(with_move.begin(), term_count, move.begin());
    squares = with_move[term_count];
  }

  [[nodiscard]] Weights solved() const;
  /// What is left of the squares with these weights, by the mean of the samples.
  [[nodiscard]] double left(const Weights& weights) const {
    double sum = squares;
    for (std::size_t i = 0; i < term_count; ++i) {
      sum -= 2.0 * weights[i] * move[i];
      for (std::size_t j = 0; j < term_count; ++j) {
        sum += weights[i] * weights[j] * (j <= i ? terms[i][j] : terms[j][i]);
      }
    }
    return sum / sample_weight;
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

}  // namespace

PNEUMA_CLONED std::optional<DriftWeights> better_weights(const MeshOrder& order, const std::vector<Lanes>& moves,
                                                         const MoveHistory& history, const RingHistory& rings,
                                                         const DriftWeights& last) {
  // What is left of any vertex by the rounding of points.
  constexpr double noise = 1.5;
  const Normal normal(Samples(order, moves, history, rings, from_units(last)));
  const DriftWeights fitted = in_units(normal.solved());
  const double gain = (normal.left(from_units(last)) + noise) / (normal.left(from_units(fitted)) + noise);
  if (!(1.5 * static_cast<double>(order.size()) * std::log2(gain) > weights_bits)) return std::nullopt;
  return fitted;
}

}  // namespace pneuma::codec
