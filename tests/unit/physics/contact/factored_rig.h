// A ball that an implicit step solved for, with the metric of its contacts, and without a world around it.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "physics/contact/factored_response.h"
#include "physics/forces/soft_setup.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {

struct FactoredBallTraits {
  std::uint32_t subdivisions = 1;
  double stiffness_n_m = 1e3;
  double gas_stiffness = 0.0;  // as BodyMetric::Place has it
  double stress_n_m = 0.0;
  std::vector<std::uint32_t> pins = {};
  std::vector<double> mass_scale = {};
};

/// Of half a metre's radius and 1 kg. Its metric points into it, so it stays where it was made.
class FactoredBall {
 public:
  static constexpr double step_s = 1.0 / 240.0;
  static constexpr double radius_m = 0.5;

  explicit FactoredBall(const FactoredBallTraits& traits) : traits_(traits) {
    SoftBody body;
    body.mesh = *make_icosphere(traits.subdivisions, radius_m);
    body.mass_kg = 1.0;
    body.springs = {.stiffness_n_m = traits.stiffness_n_m, .damping_n_s_m = 0.3};
    body.pins = traits.pins;
    body.vertex_mass_scale = traits.mass_scale;
    state_ = make_soft_state<double>(body);
    ImplicitMatrices().update(matrix_, state_, Surroundings{}, step_s);
    find_volume_gradient();
    metric_.begin(*matrix_, traits.pins.empty(), state_.x);
    (void)answer(std::vector<Vec3d>(state_.x.size(), Vec3d::Zero()));
  }
  FactoredBall(const FactoredBall&) = delete;
  FactoredBall& operator=(const FactoredBall&) = delete;

  [[nodiscard]] const SoftState<double>& state() const { return state_; }
  [[nodiscard]] const BodyMetric& metric() const { return metric_; }
  [[nodiscard]] std::span<const Vec3d> volume_gradient_m2() const { return volume_gradient_m2_; }

  /// The velocities that impulses on all vertices give.
  [[nodiscard]] std::vector<Vec3d> answer(const std::vector<Vec3d>& impulses_n_s) {
    std::vector<Vec3d> found_m_s;
    metric_.move_to({state_.x, volume_gradient_m2_, traits_.gas_stiffness, traits_.stress_n_m}, impulses_n_s,
                    found_m_s);
    return found_m_s;
  }

 private:
  void find_volume_gradient() {
    volume_gradient_m2_.assign(state_.x.size(), Vec3d::Zero());
    for (const auto& [a, b, c] : state_.body.mesh->faces) {
      const Vec3d share_m2 = (state_.x[b] - state_.x[a]).cross(state_.x[c] - state_.x[a]) / 6.0;
      for (const std::uint32_t vertex : {a, b, c}) {
        if (!state_.is_pinned(vertex)) volume_gradient_m2_[vertex] += share_m2;
      }
    }
  }

  FactoredBallTraits traits_;
  SoftState<double> state_;
  ImplicitMatrixPtr matrix_;
  std::vector<Vec3d> volume_gradient_m2_;
  BodyMetric metric_;
};

inline Support support_at(std::uint32_t body, std::span<const std::uint32_t> vertices,
                          std::span<const double> weights) {
  Support support;
  support.body = body;
  for (std::size_t i = 0; i < vertices.size(); ++i) support.add(vertices[i], weights[i]);
  return support;
}

}  // namespace pneuma::physics
