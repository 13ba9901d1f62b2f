// Ends a method of steps sooner, by what its last steps have in common.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace pneuma::physics {

/// Source: Walker and Ni, "Anderson Acceleration for Fixed-Point Iterations", 2011.
class StepMix {
 public:
  /// A step leads to `next`, by `change`, which may be weighed. Puts the point to go on from in the place of `next`:
  /// that mix of the last steps whose changes nearly cancel each other. Sizes are multiples of dense_block
  /// (row_matrix.h).
  void go_on(std::span<const double> change, std::vector<double>& next);
  /// The steps that follow have nothing to do with those before.
  void forget();

 private:
  static constexpr int steps_max = 8;  // four took a sixth more steps, twelve as many
  using Products = Eigen::Matrix<double, steps_max, steps_max>;
  using Shares = Eigen::Matrix<double, steps_max, 1>;
  // By how much a step differs from the one before it.
  struct Difference {
    std::vector<double> change, next;
  };

  void remember(std::span<const double> change, std::span<const double> next);

  std::vector<Difference> differences_;
  std::size_t latest_ = 0;                           // of them
  Products products_ = Products::Zero();             // of their changes with each other
  std::vector<double> change_before_, next_before_;  // empty: there was no step before
  double least_change_ = 0.0;
  std::vector<double> mixed_;  // scratch
};

}  // namespace pneuma::physics
