// The factor kernels' one source. Include only where PNEUMA_LANES names the instruction set that the file is compiled
// for, as with lane_pack.h.
#pragma once

#include "physics/implicit/factor_kernels.h"
#include "physics/lanes/lane_pack.h"

namespace pneuma::physics {
inline namespace PNEUMA_LANES {

/// A row's numbers, in as many packs as it takes. No fused multiply-add: it would gain little here, and a processor
/// without one would take many times as long.
template <std::size_t Columns, class P>
struct RowPacks {
  static constexpr std::size_t count = Columns / P::width;
  P packs[count];

  static RowPacks zero() {
    RowPacks r;
    for (std::size_t i = 0; i < count; ++i) r.packs[i] = P::all(0);
    return r;
  }
  static RowPacks load(const FactorRow<Columns>& row) {
    RowPacks r;
    for (std::size_t i = 0; i < count; ++i) r.packs[i] = P::load(row.columns + i * P::width);
    return r;
  }
  void store(FactorRow<Columns>& row) const {
    for (std::size_t i = 0; i < count; ++i) packs[i].store(row.columns + i * P::width);
  }
  friend RowPacks operator+(const RowPacks& a, const RowPacks& b) {
    RowPacks r;
    for (std::size_t i = 0; i < count; ++i) r.packs[i] = a.packs[i] + b.packs[i];
    return r;
  }
  friend RowPacks operator-(const RowPacks& a, const RowPacks& b) {
    RowPacks r;
    for (std::size_t i = 0; i < count; ++i) r.packs[i] = a.packs[i] - b.packs[i];
    return r;
  }
  friend RowPacks operator*(double scale, const RowPacks& a) {
    RowPacks r;
    for (std::size_t i = 0; i < count; ++i) r.packs[i] = P::all(scale) * a.packs[i];
    return r;
  }
};

// L y = b. By rows each sum stays in registers; by columns it goes through memory for every entry.
template <class Row, std::size_t Columns>
void substitute_forward(const Factor& factor, FactorRow<Columns>* rows) {
  if (factor.rows.begins != nullptr) {
    const FactorLines lines = factor.rows;
    for (std::size_t row = 0; row < factor.count; ++row) {
      Row y = Row::load(rows[row]);
      const std::size_t end = lines.begins[row + 1];
      for (std::size_t e = lines.begins[row]; e < end; ++e) y = y - lines.values[e] * Row::load(rows[lines.places[e]]);
      y.store(rows[row]);
    }
    return;
  }
  const FactorLines lines = factor.columns;
  for (std::size_t column = 0; column < factor.count; ++column) {
    const Row y = Row::load(rows[column]);
    const std::size_t end = lines.begins[column + 1];
    for (std::size_t e = lines.begins[column]; e < end; ++e) {
      FactorRow<Columns>& target = rows[lines.places[e]];
      (Row::load(target) - lines.values[e] * y).store(target);
    }
  }
}

// D L^T x = y.
template <class Row, std::size_t Columns>
void substitute_backward(const Factor& factor, FactorRow<Columns>* rows) {
  const FactorLines lines = factor.columns;
  for (std::size_t column = factor.count; column-- > 0;) {
    const std::size_t end = lines.begins[column + 1];
    std::size_t e = lines.begins[column];
    // Two sums, so that not every addition waits for the last.
    Row even = Row::zero();
    Row odd = Row::zero();
    for (; e + 2 <= end; e += 2) {
      even = even + lines.values[e] * Row::load(rows[lines.places[e]]);
      odd = odd + lines.values[e + 1] * Row::load(rows[lines.places[e + 1]]);
    }
    if (e < end) even = even + lines.values[e] * Row::load(rows[lines.places[e]]);
    (factor.inverse_diagonal[column] * Row::load(rows[column]) - (even + odd)).store(rows[column]);
  }
}

template <std::size_t Columns, class P>
void solve_factored(const Factor& factor, FactorRow<Columns>* rows) {
  substitute_forward<RowPacks<Columns, P>>(factor, rows);
  substitute_backward<RowPacks<Columns, P>>(factor, rows);
}

template <class P4, class P8>
consteval FactorKernels list_factor_kernels() {
  return {&solve_factored<4, P4>, &solve_factored<8, P8>};
}

}  // namespace PNEUMA_LANES
}  // namespace pneuma::physics
