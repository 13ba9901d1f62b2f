// The dense kernels' one source. Include only where PNEUMA_LANES names the instruction set that the file is compiled
// for, as with lane_pack.h. No fused multiply-add: a processor without one would take many times as long.
#pragma once

#include <cmath>

#include "physics/contact/dense_kernels.h"
#include "physics/lanes/lane_pack.h"

namespace pneuma::physics {
inline namespace PNEUMA_LANES {

// Subtracts from a block (Tall packs of rows, dense_block columns) what the columns before it contribute.
template <class P, std::size_t Tall>
void take_columns_before(double* matrix, std::size_t row, std::size_t column, std::size_t stride) {
  P sums[Tall][dense_block];
  for (std::size_t c = 0; c < dense_block; ++c) {
    for (std::size_t t = 0; t < Tall; ++t) {
      sums[t][c] = P::load(matrix + (column + c) * stride + row + t * P::width);
    }
  }
  for (std::size_t k = 0; k < column; ++k) {
    const double* before = matrix + k * stride;
    P rows[Tall];
    for (std::size_t t = 0; t < Tall; ++t) rows[t] = P::load(before + row + t * P::width);
    for (std::size_t c = 0; c < dense_block; ++c) {
      const P share = P::all(before[column + c]);
      for (std::size_t t = 0; t < Tall; ++t) sums[t][c] = sums[t][c] - rows[t] * share;
    }
  }
  for (std::size_t c = 0; c < dense_block; ++c) {
    for (std::size_t t = 0; t < Tall; ++t) sums[t][c].store(matrix + (column + c) * stride + row + t * P::width);
  }
}

// Factors the block on the diagonal. `inverses`: 1 over its diagonal, and 0 beyond the matrix.
inline bool factor_corner(double* matrix, std::size_t begin, std::size_t count, std::size_t stride, double* inverses) {
  for (std::size_t c = 0; c < dense_block; ++c) {
    inverses[c] = 0.0;
    if (begin + c >= count) continue;
    double* column = matrix + (begin + c) * stride + begin;
    for (std::size_t r = c; r < dense_block; ++r) {
      double value = column[r];
      for (std::size_t k = 0; k < c; ++k) {
        const double* before = matrix + (begin + k) * stride + begin;
        value -= before[r] * before[c];
      }
      if (r > c) {
        column[r] = value * inverses[c];
        continue;
      }
      if (!(value > 0.0)) return false;
      column[c] = std::sqrt(value);
      inverses[c] = 1.0 / column[c];
    }
  }
  return true;
}

template <class P>
void factor_rows_below(double* matrix, std::size_t begin, std::size_t stride, const double* inverses) {
  for (std::size_t row = begin + dense_block; row < stride; row += P::width) {
    P values[dense_block];
    for (std::size_t c = 0; c < dense_block; ++c) {
      values[c] = P::load(matrix + (begin + c) * stride + row);
      for (std::size_t k = 0; k < c; ++k) {
        values[c] = values[c] - values[k] * P::all(matrix[(begin + k) * stride + begin + c]);
      }
      values[c] = values[c] * P::all(inverses[c]);
      values[c].store(matrix + (begin + c) * stride + row);
    }
  }
}

template <class P, std::size_t Tall>
bool factor_dense(double* matrix, std::size_t count, std::size_t stride) {
  double inverses[dense_block];
  for (std::size_t begin = 0; begin < count; begin += dense_block) {
    std::size_t row = begin;
    for (; row + Tall * P::width <= stride; row += Tall * P::width) {
      take_columns_before<P, Tall>(matrix, row, begin, stride);
    }
    for (; row < stride; row += P::width) take_columns_before<P, 1>(matrix, row, begin, stride);
    if (!factor_corner(matrix, begin, count, stride, inverses)) return false;
    factor_rows_below<P>(matrix, begin, stride, inverses);
  }
  return true;
}

// Wide packs of a row less the rows [begin, end), each by its number in the factor: those are `step` apart.
template <class P, std::size_t Wide>
void take_rows(const double* numbers, std::size_t step, std::size_t begin, std::size_t end, const double* rows,
               std::size_t width, P* sums) {
  for (std::size_t i = begin; i < end; ++i) {
    const P number = P::all(numbers[i * step]);
    for (std::size_t w = 0; w < Wide; ++w) sums[w] = sums[w] - P::load(rows + i * width + w * P::width) * number;
  }
}

template <class P, std::size_t Wide>
void solve_forward_strip(const double* factor, std::size_t count, std::size_t stride, double* rows, std::size_t width) {
  for (std::size_t k = 0; k < count; ++k) {
    P sums[Wide];
    for (std::size_t w = 0; w < Wide; ++w) sums[w] = P::load(rows + k * width + w * P::width);
    take_rows<P, Wide>(factor + k, stride, 0, k, rows, width, sums);
    const P pivot = P::all(factor[k * stride + k]);
    for (std::size_t w = 0; w < Wide; ++w) (sums[w] / pivot).store(rows + k * width + w * P::width);
  }
}

template <class P, std::size_t Wide>
void solve_backward_strip(const double* factor, std::size_t count, std::size_t stride, double* rows,
                          std::size_t width) {
  for (std::size_t k = count; k-- > 0;) {
    P sums[Wide];
    for (std::size_t w = 0; w < Wide; ++w) sums[w] = P::load(rows + k * width + w * P::width);
    take_rows<P, Wide>(factor + k * stride, 1, k + 1, count, rows, width, sums);
    const P pivot = P::all(factor[k * stride + k]);
    for (std::size_t w = 0; w < Wide; ++w) (sums[w] / pivot).store(rows + k * width + w * P::width);
  }
}

// Calls strip<packs>(at) for strips of Wide packs of the width, and then for single ones.
template <class P, std::size_t Wide, class Strip>
void for_strips(std::size_t width, const Strip& strip) {
  std::size_t at = 0;
  for (; at + Wide * P::width <= width; at += Wide * P::width) strip.template operator()<Wide>(at);
  for (; at < width; at += P::width) strip.template operator()<1>(at);
}

template <class P, std::size_t Wide>
void solve_many(const double* factor, std::size_t count, std::size_t stride, double* rows, std::size_t width) {
  for_strips<P, Wide>(width, [&]<std::size_t Packs>(std::size_t at) {
    solve_forward_strip<P, Packs>(factor, count, stride, rows + at, width);
    solve_backward_strip<P, Packs>(factor, count, stride, rows + at, width);
  });
}

// Forward by columns, then back by rows of the transpose. Each row's sum is eight sums, added in one order on every
// instruction set.
template <class P>
void solve_dense(const double* factor, std::size_t count, std::size_t stride, double* b) {
  for (std::size_t k = 0; k < count; ++k) {
    const double* column = factor + k * stride;
    const double value = b[k] / column[k];
    std::size_t row = (k + 1 + dense_block - 1) / dense_block * dense_block;
    for (std::size_t i = k + 1; i < row; ++i) b[i] -= column[i] * value;
    const P share = P::all(value);
    for (; row < stride; row += P::width) (P::load(b + row) - P::load(column + row) * share).store(b + row);
    b[k] = value;
  }
  for (std::size_t k = count; k-- > 0;) {
    const double* column = factor + k * stride;
    const std::size_t row = (k + 1 + dense_block - 1) / dense_block * dense_block;
    double rest = 0.0;
    for (std::size_t i = k + 1; i < row; ++i) rest += column[i] * b[i];
    double sums[dense_block];
    for (std::size_t lane = 0; lane < dense_block; lane += P::width) {
      P sum = P::all(0.0);
      for (std::size_t i = row + lane; i < stride; i += dense_block) sum = sum + P::load(column + i) * P::load(b + i);
      sum.store(sums + lane);
    }
    const double low = (sums[0] + sums[1]) + (sums[2] + sums[3]);
    const double high = (sums[4] + sums[5]) + (sums[6] + sums[7]);
    b[k] = (b[k] - (rest + (low + high))) / column[k];
  }
}

template <class P>
void add_dense_columns(const double* first, double first_share, const double* second, double second_share,
                       std::size_t size, double* sum) {
  const P of_first = P::all(first_share);
  const P of_second = P::all(second_share);
  for (std::size_t i = 0; i < size; i += P::width) {
    (P::load(sum + i) + (P::load(first + i) * of_first + P::load(second + i) * of_second)).store(sum + i);
  }
}

template <class P>
void add_dense_column(const double* column, const double* shares, std::size_t size, double* sums) {
  const P x = P::all(shares[0]);
  const P y = P::all(shares[1]);
  const P z = P::all(shares[2]);
  for (std::size_t i = 0; i < size; i += P::width) {
    const P value = P::load(column + i);
    (P::load(sums + i) + value * x).store(sums + i);
    (P::load(sums + size + i) + value * y).store(sums + size + i);
    (P::load(sums + 2 * size + i) + value * z).store(sums + 2 * size + i);
  }
}

// Two columns at a time. An odd last one is added with itself times 0.
template <class P>
void add_dense_product(const double* matrix, std::size_t count, std::size_t stride, const double* x, double* sum) {
  for (std::size_t k = 0; k < count; k += 2) {
    const bool has_next = k + 1 < count;
    const double* column = matrix + k * stride;
    add_dense_columns<P>(column, x[k], has_next ? column + stride : column, has_next ? x[k + 1] : 0.0, stride, sum);
  }
}

template <class P, std::size_t Tall>
consteval DenseKernels list_dense_kernels() {
  constexpr std::size_t wide = 4;
  return {&factor_dense<P, Tall>, &solve_dense<P>, &solve_many<P, wide>, &add_dense_product<P>, &add_dense_column<P>};
}

}  // namespace PNEUMA_LANES
}  // namespace pneuma::physics
