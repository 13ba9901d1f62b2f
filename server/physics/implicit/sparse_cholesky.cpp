#include "physics/implicit/sparse_cholesky.h"

#include <cassert>
#include <cmath>

#include <Eigen/SparseCholesky>

#include "physics/lanes/isa.h"

namespace pneuma::physics {

namespace {

// Larger factors are in no near cache anyway, and are not held twice for time's sake.
constexpr Eigen::Index entries_by_rows_max = 65'536;

}  // namespace

bool SparseCholesky::factor(const Eigen::SparseMatrix<double>& matrix) {
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt(matrix);
  if (ldlt.info() != Eigen::Success) return false;
  kernels_ = &factor_kernels(isa_in_use());
  const auto count = static_cast<std::size_t>(matrix.rows());
  const Eigen::VectorXd pivots = ldlt.vectorD();  // which makes a vector at each call
  places_.resize(count);
  inverse_diagonal_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    places_[i] = static_cast<std::uint32_t>(ldlt.permutationP().indices()[row]);
    inverse_diagonal_[i] = 1.0 / pivots[row];
    if (!std::isfinite(inverse_diagonal_[i]) || !(inverse_diagonal_[i] > 0.0)) return false;
  }
  const Eigen::SparseMatrix<double>& lower = ldlt.matrixL().nestedExpression();  // without its diagonal of ones
  columns_ = {};
  columns_.take(lower);
  rows_ = {};
  if (lower.nonZeros() <= entries_by_rows_max) rows_.take(lower.transpose());
  return true;
}

void SparseCholesky::Lines::take(const Eigen::SparseMatrix<double>& strict_triangle) {
  const auto entries = static_cast<std::size_t>(strict_triangle.nonZeros());
  begins = {0};
  begins.reserve(static_cast<std::size_t>(strict_triangle.outerSize()) + 1);
  places.reserve(entries);
  values.reserve(entries);
  for (Eigen::Index line = 0; line < strict_triangle.outerSize(); ++line) {
    for (Eigen::SparseMatrix<double>::InnerIterator entry(strict_triangle, line); entry; ++entry) {
      places.push_back(static_cast<std::uint32_t>(entry.index()));
      values.push_back(entry.value());
    }
    begins.push_back(static_cast<std::uint32_t>(places.size()));
  }
}

FactorLines SparseCholesky::Lines::view() const {
  return {begins.empty() ? nullptr : begins.data(), places.data(), values.data()};
}

std::size_t SparseCholesky::Lines::bytes() const {
  return (begins.capacity() + places.capacity()) * sizeof(std::uint32_t) + values.capacity() * sizeof(double);
}

Factor SparseCholesky::factor() const {
  return {columns_.view(), rows_.view(), inverse_diagonal_.data(), places_.size()};
}

void SparseCholesky::solve(std::span<FactorRow<4>> rows) const {
  assert(rows.size() == places_.size());
  kernels_->solve4(factor(), rows.data());
}

void SparseCholesky::solve(std::span<FactorRow<8>> rows) const {
  assert(rows.size() == places_.size());
  kernels_->solve8(factor(), rows.data());
}

std::size_t SparseCholesky::bytes() const {
  return places_.capacity() * sizeof(std::uint32_t) + inverse_diagonal_.capacity() * sizeof(double) + columns_.bytes() +
         rows_.bytes();
}

}  // namespace pneuma::physics
