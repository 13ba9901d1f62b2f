#include "physics/sparse_cholesky.h"

#include <cmath>
#include <type_traits>

#include <Eigen/SparseCholesky>

namespace pneuma::physics {

bool SparseCholesky::factor(const Eigen::SparseMatrix<double>& matrix) {
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt(matrix);
  if (ldlt.info() != Eigen::Success) return false;
  const auto count = static_cast<std::size_t>(matrix.rows());
  place_.resize(count);
  inverse_diagonal_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    place_[i] = static_cast<std::uint32_t>(ldlt.permutationP().indices()[row]);
    inverse_diagonal_[i] = 1.0 / ldlt.vectorD()[row];
    if (!std::isfinite(inverse_diagonal_[i]) || !(inverse_diagonal_[i] > 0.0)) return false;
  }
  entries_.clear();
  column_ends_.clear();
  const auto& lower = ldlt.matrixL().nestedExpression();
  for (Eigen::Index column = 0; column < lower.outerSize(); ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator entry(lower, column); entry; ++entry) {
      if (entry.row() > column) entries_.push_back({entry.value(), static_cast<std::uint32_t>(entry.row())});
    }
    column_ends_.push_back(static_cast<std::uint32_t>(entries_.size()));
  }
  return true;
}

template <std::size_t Columns>
void SparseCholesky::solve(std::span<std::array<double, Columns>> rows) {
  std::vector<std::array<double, Columns>>* chosen = nullptr;
  if constexpr (Columns == 4) {
    chosen = &work4_;
  } else {
    chosen = &work6_;
  }
  std::vector<std::array<double, Columns>>& work = *chosen;
  work.resize(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) work[place_[i]] = rows[i];
  std::size_t entry = 0;
  for (std::size_t column = 0; column < work.size(); ++column) {
    const std::array<double, Columns> x = work[column];
    for (; entry < column_ends_[column]; ++entry) {
      std::array<double, Columns>& target = work[entries_[entry].row];
      const double value = entries_[entry].value;
      for (std::size_t c = 0; c < Columns; ++c) target[c] -= value * x[c];
    }
  }
  for (std::size_t column = work.size(); column-- > 0;) {
    std::array<double, Columns> x = work[column];
    for (std::size_t c = 0; c < Columns; ++c) x[c] *= inverse_diagonal_[column];
    const std::size_t first = column == 0 ? 0 : column_ends_[column - 1];
    for (std::size_t e = first; e < column_ends_[column]; ++e) {
      const std::array<double, Columns>& source = work[entries_[e].row];
      const double value = entries_[e].value;
      for (std::size_t c = 0; c < Columns; ++c) x[c] -= value * source[c];
    }
    work[column] = x;
  }
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = work[place_[i]];
}

std::size_t SparseCholesky::bytes() const {
  return entries_.capacity() * sizeof(Entry) + (place_.capacity() + column_ends_.capacity()) * sizeof(std::uint32_t) +
         inverse_diagonal_.capacity() * sizeof(double) + work4_.capacity() * sizeof(work4_[0]) +
         work6_.capacity() * sizeof(work6_[0]);
}

template void SparseCholesky::solve<4>(std::span<std::array<double, 4>>);
template void SparseCholesky::solve<6>(std::span<std::array<double, 6>>);

}  // namespace pneuma::physics
