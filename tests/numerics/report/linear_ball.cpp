#include "numerics/report/linear_ball.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "physics/mesh/mesh_builders.h"

namespace pneuma::report {
namespace {

using physics::Integrator;
using physics::Vec3d;

constexpr double coupled_share = 1e-9;  // of gradV along a mode: less is round-off
constexpr double same_eigenvalue = 1e-9;

Eigen::MatrixXd spring_matrix(const physics::Mesh& mesh) {
  const auto size = static_cast<Eigen::Index>(3 * mesh.positions_m.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
  for (const auto& [a, b] : mesh.edges) {
    const Vec3d n = (mesh.positions_m[b] - mesh.positions_m[a]).normalized();
    const Eigen::Matrix3d along = n * n.transpose();
    matrix.block<3, 3>(3 * a, 3 * a) += along;
    matrix.block<3, 3>(3 * b, 3 * b) += along;
    matrix.block<3, 3>(3 * a, 3 * b) -= along;
    matrix.block<3, 3>(3 * b, 3 * a) -= along;
  }
  return matrix;
}

Eigen::VectorXd volume_gradient_m2(const physics::Mesh& mesh) {
  const std::vector<Vec3d>& x = mesh.positions_m;
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * x.size()));
  for (const auto& [a, b, c] : mesh.faces) {
    const Vec3d share = (x[b] - x[a]).cross(x[c] - x[a]) / 6.0;
    for (const std::uint32_t vertex : {a, b, c}) gradient.segment<3>(3 * vertex) += share;
  }
  return gradient;
}

Eigen::VectorXd scaling(const physics::Mesh& mesh) {
  Eigen::VectorXd scaling(static_cast<Eigen::Index>(3 * mesh.positions_m.size()));
  for (std::size_t i = 0; i < mesh.positions_m.size(); ++i) {
    scaling.segment<3>(static_cast<Eigen::Index>(3 * i)) = mesh.positions_m[i];
  }
  return scaling;
}

/// What a step of h does to (u, u').
Eigen::MatrixXd step_matrix(Integrator integrator, const LinearBall::Block& block, double h) {
  const Eigen::Index n = block.stiffness_1_s2.rows();
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd step(2 * n, 2 * n);
  if (integrator == Integrator::symplectic_euler) {
    const Eigen::MatrixXd kept = one - h * block.damping_1_s;
    step << one - h * h * block.stiffness_1_s2, h * kept, -h * block.stiffness_1_s2, kept;
    return step;
  }
  Eigen::MatrixXd z(2 * n, 2 * n);
  z << Eigen::MatrixXd::Zero(n, n), h * one, -h * block.stiffness_1_s2, -h * block.damping_1_s;
  // The exponential's series, as far as the method's order goes.
  const int order = integrator == Integrator::rk4 ? 4 : integrator == Integrator::midpoint ? 2 : 1;
  step.setIdentity();
  for (int power = order; power > 0; --power)
    step = (Eigen::MatrixXd::Identity(2 * n, 2 * n) + z * step / power).eval();
  return step;
}

double spectral_radius(const Eigen::MatrixXd& matrix) {
  if (matrix.rows() > 2) return Eigen::EigenSolver<Eigen::MatrixXd>(matrix, false).eigenvalues().cwiseAbs().maxCoeff();
  const double half_trace = matrix.trace() / 2.0;
  const double determinant = matrix.determinant();
  const double discriminant = half_trace * half_trace - determinant;
  return discriminant < 0.0 ? std::sqrt(determinant) : std::abs(half_trace) + std::sqrt(discriminant);
}

}  // namespace

LinearBall::LinearBall() : mesh_(*physics::make_icosphere(2, radius_m)) {
  volume_m3_ = physics::signed_volume_m3(mesh_->positions_m, mesh_->faces);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(spring_matrix(*mesh_));
  const Eigen::VectorXd along_gradient = solver.eigenvectors().transpose() * volume_gradient_m2(*mesh_);
  std::vector<Eigen::Index> coupled;
  for (Eigen::Index i = 0; i < along_gradient.size(); ++i) {  // eigenvalues rise
    if (std::abs(along_gradient[i]) > coupled_share * along_gradient.norm()) {
      coupled.push_back(i);
      continue;
    }
    const double eigenvalue = std::max(0.0, solver.eigenvalues()[i]);
    if (free_eigenvalues_.empty() || eigenvalue > free_eigenvalues_.back() + same_eigenvalue) {
      free_eigenvalues_.push_back(eigenvalue);
    }
    fastest_free_ = solver.eigenvectors().col(i);
  }
  gas_eigenvalues_ = solver.eigenvalues()(coupled);
  gas_modes_ = solver.eigenvectors()(Eigen::all, coupled);
  gas_gradient_ = along_gradient(coupled);
}

double LinearBall::gas_stiffness() const {
  return pressure_pa / volume_m3_;
}

double LinearBall::gas_energy_j(double volume_m3) const {
  const double growth = (volume_m3 - volume_m3_) / volume_m3_;
  return pressure_pa * volume_m3_ * (growth - std::log1p(growth));
}

double LinearBall::stored_j(const Mode& mode, const std::vector<Vec3d>& positions_m) const {
  double along_m = 0.0;
  for (std::size_t i = 0; i < positions_m.size(); ++i) {
    along_m += mode.direction.segment<3>(static_cast<Eigen::Index>(3 * i)).dot(positions_m[i] - mesh_->positions_m[i]);
  }
  along_m /= mode.direction.norm();
  return 0.5 * vertex_mass_kg() * std::pow(mode.frequency_rad_s * along_m, 2);
}

std::vector<LinearBall::Block> LinearBall::blocks(double stiffness_n_m, double damping_n_s_m) const {
  std::vector<Block> blocks;
  for (const double eigenvalue : free_eigenvalues_) {
    blocks.push_back({Eigen::MatrixXd::Constant(1, 1, stiffness_n_m * eigenvalue / vertex_mass_kg()),
                      Eigen::MatrixXd::Constant(1, 1, damping_n_s_m * eigenvalue / vertex_mass_kg())});
  }
  const Eigen::MatrixXd springs = gas_eigenvalues_.asDiagonal();
  blocks.push_back(
      {(stiffness_n_m * springs + gas_stiffness() * gas_gradient_ * gas_gradient_.transpose()) / vertex_mass_kg(),
       damping_n_s_m * springs / vertex_mass_kg()});
  return blocks;
}

// Of the motions that the gas takes part in, the one most like `likeness`.
LinearBall::Mode LinearBall::mode_in_gas(double stiffness_n_m, const Eigen::VectorXd& likeness) const {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(blocks(stiffness_n_m, 0.0).back().stiffness_1_s2);
  Eigen::Index most_alike = 0;
  (solver.eigenvectors().transpose() * (gas_modes_.transpose() * likeness)).cwiseAbs().maxCoeff(&most_alike);
  const Eigen::VectorXd direction = gas_modes_ * solver.eigenvectors().col(most_alike);
  return {std::sqrt(solver.eigenvalues()[most_alike]), direction / direction.cwiseAbs().maxCoeff()};
}

LinearBall::Mode LinearBall::breathing(double stiffness_n_m) const {
  return mode_in_gas(stiffness_n_m, scaling(*mesh_));
}

LinearBall::Mode LinearBall::fastest_of_springs(double stiffness_n_m) const {
  const double stiffness_1_s2 = stiffness_n_m * free_eigenvalues_.back() / vertex_mass_kg();
  return {std::sqrt(stiffness_1_s2), fastest_free_ / fastest_free_.cwiseAbs().maxCoeff()};
}

LinearBall::Mode LinearBall::fastest(double stiffness_n_m) const {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(blocks(stiffness_n_m, 0.0).back().stiffness_1_s2);
  Mode of_springs = fastest_of_springs(stiffness_n_m);
  Mode in_gas = mode_in_gas(stiffness_n_m, gas_modes_ * solver.eigenvectors().rightCols<1>());
  return in_gas.frequency_rad_s > of_springs.frequency_rad_s ? in_gas : of_springs;
}

double LinearBall::stability_limit_s(Integrator integrator, double stiffness_n_m, double damping_n_s_m) const {
  const std::vector<Block> all = blocks(stiffness_n_m, damping_n_s_m);
  const auto grows = [&](double step_s) {
    return std::ranges::any_of(all, [&](const Block& block) {
      return spectral_radius(step_matrix(integrator, block, step_s)) > std::exp(growth_max_1_s * step_s);
    });
  };
  double below_s = 1e-9;
  double above_s = 10.0;
  while (above_s > below_s * (1.0 + 1e-4)) {
    const double middle_s = std::sqrt(below_s * above_s);
    (grows(middle_s) ? above_s : below_s) = middle_s;
  }
  return below_s;
}

physics::Scene LinearBall::scene(double stiffness_n_m, double damping_n_s_m, const Eigen::VectorXd& direction,
                                 double displacement_m) const {
  auto displaced = std::make_shared<physics::Mesh>(*mesh_);
  for (std::size_t i = 0; i < vertex_count(); ++i) {
    displaced->positions_m[i] += displacement_m * direction.segment<3>(static_cast<Eigen::Index>(3 * i));
  }
  physics::SoftBody body;
  body.name = "ball";
  body.mesh = displaced;
  body.mass_kg = mass_kg;
  body.springs = {.stiffness_n_m = stiffness_n_m, .damping_n_s_m = damping_n_s_m};
  body.gas = physics::Gas{.moles = pressure_pa * volume_m3_ / (physics::gas_constant_j_mol_k * temperature_k),
                          .temperature_k = temperature_k};
  physics::Scene scene;
  scene.stepping.on_unstable = physics::OnUnstable::allow;
  scene.stepping.sleep = false;
  scene.atmosphere.pressure_pa = pressure_pa;
  scene.soft_bodies.push_back(body);
  return scene;
}

}  // namespace pneuma::report
