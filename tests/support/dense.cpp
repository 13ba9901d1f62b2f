#include "support/dense.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace pneuma::support {

Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(symmetric, Eigen::EigenvaluesOnly).eigenvalues();
}

Eigen::MatrixXd inverse(const Eigen::MatrixXd& matrix) {
  return matrix.partialPivLu().inverse();
}

}  // namespace pneuma::support
