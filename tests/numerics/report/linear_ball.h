// A ball whose small motions are known exactly, and what theory says of them: which steps an explicit integrator takes.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "physics/scene/scene.h"

namespace pneuma::report {

/// Steps past this make the fastest-growing motion grow e-fold in a second or faster: the bound by which the server
/// refuses a step (stability_limit_s).
inline constexpr double growth_max_1_s = 1.0;

/// 162 vertices of 1 kg in all, radius 0.5 m, in air of the pressure that its gas has: neither springs nor pressure
/// pull anywhere, so the linearised stiffness is the springs' and the gas's rank-one term alone. Springs and damping
/// have one pattern; its eigenvalues are found once, every entry of the matrix counted (Eigen's self-adjoint solver).
class LinearBall {
 public:
  static constexpr double pressure_pa = 100.0;
  static constexpr double radius_m = 0.5;
  static constexpr double mass_kg = 1.0;
  static constexpr double temperature_k = 293.15;

  LinearBall();

  /// Small motions that do not mix: u'' = -stiffness u - damping u'.
  struct Block {
    Eigen::MatrixXd stiffness_1_s2;
    Eigen::MatrixXd damping_1_s;
  };
  [[nodiscard]] std::vector<Block> blocks(double stiffness_n_m, double damping_n_s_m) const;

  struct Mode {
    double frequency_rad_s = 0.0;  // undamped
    Eigen::VectorXd direction;     // x, y, z a vertex; the largest of them is 1
  };
  [[nodiscard]] Mode fastest(double stiffness_n_m) const;
  /// Of those that leave the volume as it is.
  [[nodiscard]] Mode fastest_of_springs(double stiffness_n_m) const;
  [[nodiscard]] Mode breathing(double stiffness_n_m) const;

  /// The longest step at which no motion grows faster than growth_max_1_s, of an explicit integrator.
  [[nodiscard]] double stability_limit_s(physics::Integrator integrator, double stiffness_n_m,
                                         double damping_n_s_m) const;

  /// The ball displaced by `displacement_m` along `direction`, its rest lengths those of the ball at rest.
  [[nodiscard]] physics::Scene scene(double stiffness_n_m, double damping_n_s_m, const Eigen::VectorXd& direction,
                                     double displacement_m) const;
  /// Of the gas and the outside, over that at rest.
  [[nodiscard]] double gas_energy_j(double volume_m3) const;

  /// Of springs and gas in a motion, where the vertices are at `positions_m`.
  [[nodiscard]] double stored_j(const Mode& mode, const std::vector<physics::Vec3d>& positions_m) const;

  [[nodiscard]] std::size_t vertex_count() const { return mesh_->positions_m.size(); }

 private:
  [[nodiscard]] double gas_stiffness() const;  // -dP/dV, Pa/m^3
  [[nodiscard]] double vertex_mass_kg() const { return mass_kg / static_cast<double>(vertex_count()); }
  [[nodiscard]] Mode mode_in_gas(double stiffness_n_m, const Eigen::VectorXd& likeness) const;

  std::shared_ptr<const physics::Mesh> mesh_;
  double volume_m3_ = 0.0;
  // Of the springs' matrix at 1 N/m. Those along gradV, which the gas couples, apart.
  std::vector<double> free_eigenvalues_;  // each once, in order
  Eigen::VectorXd fastest_free_;
  Eigen::VectorXd gas_eigenvalues_;
  Eigen::MatrixXd gas_modes_;     // a column each
  Eigen::VectorXd gas_gradient_;  // gradV in these modes
};

}  // namespace pneuma::report
