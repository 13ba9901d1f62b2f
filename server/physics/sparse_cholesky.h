// A symmetric positive definite N x N matrix, factored once, and solved for several right-hand sides at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/SparseCore>

namespace pneuma::physics {

class SparseCholesky {
 public:
  /// L D L^T by Eigen's simplicial factorisation, in its fill-reducing order. False where the matrix is not positive
  /// definite or not finite; solve() may not be called then.
  [[nodiscard]] bool factor(const Eigen::SparseMatrix<double>& matrix);

  /// Replaces each column of `rows` (a row a vertex) by the solution.
  template <std::size_t Columns>
  void solve(std::span<std::array<double, Columns>> rows);

  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Entry {
    double value;
    std::uint32_t row;
  };
  std::vector<std::uint32_t> place_;        // of each row in the factor's order
  std::vector<std::uint32_t> column_ends_;  // in entries_
  std::vector<Entry> entries_;              // of L below its unit diagonal, by columns
  std::vector<double> inverse_diagonal_;    // of D
  std::vector<std::array<double, 4>> work4_;
  std::vector<std::array<double, 6>> work6_;
};

}  // namespace pneuma::physics
