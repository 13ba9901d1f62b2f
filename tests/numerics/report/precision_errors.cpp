#include "numerics/report/precision_errors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

namespace pneuma::report::precision {

using physics::Vec3d;

namespace {

class MeanSquare {
 public:
  void add(double value) {
    sum_ += value * value;
    ++count_;
  }
  [[nodiscard]] double root() const {
    return count_ > 0 ? std::sqrt(sum_ / static_cast<double>(count_)) : Errors::none;
  }

 private:
  double sum_ = 0.0;
  std::size_t count_ = 0;
};

/// What energies and momenta are measured in.
struct Scales {
  double energy_j = 0.0;
  double speed_m_s = 0.0;
};

Scales scales_of(const Trajectory& reference) {
  Scales scales;
  for (const Sample& sample : reference.samples) {
    const double lost_j = std::abs(sample.energy_j - reference.samples.front().energy_j);
    scales.energy_j = std::max({scales.energy_j, sample.kinetic_j, lost_j});
    for (const physics::BodyMeasures& body : sample.soft) {
      scales.speed_m_s = std::max(scales.speed_m_s, body.max_speed_m_s);
    }
  }
  return scales;
}

/// What the bodies of a sample add to the sums over all ticks.
struct Sums {
  MeanSquare position;
  MeanSquare centre;
  MeanSquare volume;

  void add(const Sample& run, const Sample& reference, const Measuring& measuring, bool free) {
    for (std::size_t body = 0; body < run.soft.size(); ++body) {
      const double size_m = measuring.sizes_m[body];
      centre.add((run.soft[body].centre_of_mass - reference.soft[body].centre_of_mass).norm() / size_m);
      if (const double volume_m3 = reference.soft[body].volume_m3; volume_m3 > 0.0) {
        volume.add(run.soft[body].volume_m3 / volume_m3 - 1.0);
      }
      if (free) add_vertices(run.positions_m[body], reference.positions_m[body], size_m);
    }
    for (std::size_t rigid = 0; rigid < run.rigid_m.size(); ++rigid) {
      centre.add((run.rigid_m[rigid] - reference.rigid_m[rigid]).norm() / measuring.sizes_m.front());
    }
  }

 private:
  void add_vertices(const std::vector<Vec3d>& run_m, const std::vector<Vec3d>& reference_m, double size_m) {
    for (std::size_t i = 0; i < run_m.size(); ++i) position.add((run_m[i] - reference_m[i]).norm() / size_m);
  }
};

std::vector<double> volumes_m3(const Trajectory& trajectory) {
  std::vector<double> volumes;
  for (const Sample& sample : trajectory.samples) volumes.push_back(sample.soft.front().volume_m3);
  return volumes;
}

double mean_of_last(const std::vector<double>& values, std::uint64_t count) {
  double sum = 0.0;
  for (std::size_t i = values.size() - count; i < values.size(); ++i) sum += values[i];
  return sum / static_cast<double>(count);
}

// The part of a signal that no constant and sinusoid of this period explain, squared.
double unexplained(std::span<const double> signal, double dt_s, double period_s) {
  Eigen::MatrixX3d basis(static_cast<Eigen::Index>(signal.size()), 3);
  for (Eigen::Index i = 0; i < basis.rows(); ++i) {
    const double phase = 2.0 * std::numbers::pi * static_cast<double>(i) * dt_s / period_s;
    basis.row(i) << 1.0, std::cos(phase), std::sin(phase);
  }
  const Eigen::Map<const Eigen::VectorXd> values(signal.data(), basis.rows());
  const Eigen::Vector3d shares = (basis.transpose() * basis).ldlt().solve(basis.transpose() * values);
  return (values - basis * shares).squaredNorm();
}

}  // namespace

double size_m(const physics::Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3d& position : mesh.positions_m) box.extend(position);
  return box.sizes().maxCoeff();
}

Errors errors_of(const Trajectory& run, const Trajectory& reference, const Measuring& measuring) {
  const Scales scales = scales_of(reference);
  const double momentum_scale = measuring.mass_kg * scales.speed_m_s;
  Sums sums;
  MeanSquare energy;
  MeanSquare momentum;
  MeanSquare angular_momentum;
  for (std::size_t tick = 0; tick < reference.samples.size(); ++tick) {
    const Sample& at = run.samples[tick];
    const Sample& then = reference.samples[tick];
    sums.add(at, then, measuring, tick <= measuring.free_ticks);
    energy.add((at.energy_j - then.energy_j) / scales.energy_j);
    momentum.add((at.momentum - then.momentum).norm() / momentum_scale);
    angular_momentum.add((at.angular_momentum - then.angular_momentum).norm() /
                         (momentum_scale * measuring.sizes_m.front()));
  }
  Errors errors{.position = sums.position.root(),
                .centre = sums.centre.root(),
                .volume = sums.volume.root(),
                .energy = energy.root(),
                .momentum = momentum.root(),
                .angular_momentum = angular_momentum.root()};
  const std::vector<double> volumes = volumes_m3(run);
  const std::vector<double> reference_volumes = volumes_m3(reference);
  if (measuring.rest_ticks > 0) {
    const double ratio = mean_of_last(volumes, measuring.rest_ticks) / reference_volumes.back();
    errors.volume_at_rest = std::abs(ratio - 1.0);
    errors.radius_at_rest = std::abs(std::cbrt(ratio) - 1.0);
  }
  if (measuring.period_s > 0.0) {
    const double period_s = fitted_period_s(reference_volumes, measuring.tick_s, measuring.period_s);
    errors.period = std::abs(fitted_period_s(volumes, measuring.tick_s, measuring.period_s) / period_s - 1.0);
  }
  return errors;
}

double fitted_period_s(std::span<const double> signal, double dt_s, double guess_s) {
  const auto left = [&](double period_s) { return unexplained(signal, dt_s, period_s); };
  constexpr int places = 400;
  const double width_s = 0.7 * guess_s / places;
  double best_s = 0.7 * guess_s;
  for (int i = 1; i <= places; ++i) {
    const double period_s = 0.7 * guess_s + i * width_s;
    if (left(period_s) < left(best_s)) best_s = period_s;
  }
  double low_s = best_s - width_s;
  double high_s = best_s + width_s;
  for (int round = 0; round < 40; ++round) {  // golden section
    const double step_s = (high_s - low_s) / (1.0 + std::numbers::phi);
    if (left(low_s + step_s) < left(high_s - step_s)) {
      high_s -= step_s;
    } else {
      low_s += step_s;
    }
  }
  return 0.5 * (low_s + high_s);
}

}  // namespace pneuma::report::precision
