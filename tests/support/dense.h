// Dense matrices for closed forms in tests. Compiled once, as Eigen's solvers take seconds in each file that has one.
#pragma once

#include <Eigen/Core>

namespace pneuma::support {

/// The eigenvalues of a symmetric matrix, rising (Eigen's self-adjoint solver). Only the lower triangle is read.
[[nodiscard]] Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric);

/// The inverse of a regular square matrix, by LU with partial pivoting.
[[nodiscard]] Eigen::MatrixXd inverse(const Eigen::MatrixXd& matrix);

}  // namespace pneuma::support
