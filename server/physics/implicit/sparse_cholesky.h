// A symmetric positive definite N x N matrix, factored once, and solved for several right-hand sides at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/SparseCore>

#include "physics/implicit/factor_kernels.h"

namespace pneuma::physics {

class SparseCholesky {
 public:
  /// L D L^T by Eigen's simplicial factorisation, in its fill-reducing order. False where the matrix is not positive
  /// definite or not finite; solve() may not be called then.
  [[nodiscard]] bool factor(const Eigen::SparseMatrix<double>& matrix);

  /// Where each row of the matrix stands in the factor's order.
  [[nodiscard]] std::span<const std::uint32_t> places() const { return places_; }
  /// Replaces each column of `rows`, which are in the factor's order, by the solution. With the kernels of
  /// isa_in_use() when the matrix was factored.
  void solve(std::span<FactorRow<4>> rows) const;
  void solve(std::span<FactorRow<8>> rows) const;

  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Lines {
    std::vector<std::uint32_t> begins;
    std::vector<std::uint32_t> places;
    std::vector<double> values;

    void take(const Eigen::SparseMatrix<double>& strict_triangle);
    [[nodiscard]] FactorLines view() const;
    [[nodiscard]] std::size_t bytes() const;
  };
  [[nodiscard]] Factor factor() const;

  const FactorKernels* kernels_ = nullptr;
  std::vector<std::uint32_t> places_;
  Lines columns_;
  Lines rows_;  // empty where the matrix is large
  std::vector<double> inverse_diagonal_;
};

}  // namespace pneuma::physics
