// What tests ask of Eigen's solvers. Compiled once, as those take seconds in each file that has one.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace pneuma::support {

/// The eigenvalues of a symmetric matrix, rising (Eigen's self-adjoint solver). Only the lower triangle is read.
[[nodiscard]] Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric);

/// The inverse of a regular square matrix, by LU with partial pivoting.
[[nodiscard]] Eigen::MatrixXd inverse(const Eigen::MatrixXd& matrix);

/// The shortest turn that takes one direction to another.
[[nodiscard]] Eigen::Quaterniond turn_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace pneuma::support
