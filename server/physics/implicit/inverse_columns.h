// Columns of the inverse of a factored matrix, each found once, when it is asked for.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <unordered_map>
#include <vector>

#include "physics/implicit/sparse_cholesky.h"

namespace pneuma::physics {

/// For any thread: what it holds does not depend on who asked first.
class InverseColumns {
 public:
  /// `pinned`: one a row, or empty; their columns are 0. Both outlive this.
  InverseColumns(const SparseCholesky& factor, std::span<const std::uint8_t> pinned)
      : factor_(factor), pinned_(pinned) {}

  /// In the rows' own order. The spans hold as long as this does.
  [[nodiscard]] std::vector<std::span<const double>> columns(std::span<const std::uint32_t> rows);

  [[nodiscard]] std::size_t bytes() const;

 private:
  void find(std::span<const std::uint32_t> rows);

  const SparseCholesky& factor_;
  std::span<const std::uint8_t> pinned_;
  mutable std::mutex mutex_;
  std::unordered_map<std::uint32_t, std::vector<double>> columns_;
};

}  // namespace pneuma::physics
