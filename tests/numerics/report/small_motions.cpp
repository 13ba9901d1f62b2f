#include "numerics/report/small_motions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "numerics/known_scenes.h"

namespace pneuma::report {
namespace {

// Of a radius of 0.5 m: what is not linear is 1e-5 of it, and round-off 1e-10.
constexpr double displacement_m = 5e-6;
// Times the energy it began with: past some millimetres springs that are pressed flat may hold a motion.
constexpr double ran_away = 1e6;

class DisplacedBall {
 public:
  DisplacedBall(const LinearBall& ball, const SmallRun& run, const Eigen::VectorXd& direction)
      : ball_(ball), world_(physics::make_world(scene(ball, run, direction))) {}

  [[nodiscard]] double tick_s() const { return world_.tick_period_s(); }
  void step_tick() { world_.step_tick(one_thread_); }
  /// Over that at rest; none once the ball ran away.
  [[nodiscard]] std::optional<double> energy_j() const {
    if (world_.is_frozen(0)) return std::nullopt;
    const physics::BodyMeasures sums = world_.measure(0);
    const double energy_j = sums.kinetic_j + sums.elastic_j + ball_.gas_energy_j(sums.volume_m3);
    return std::isfinite(energy_j) ? std::optional(energy_j) : std::nullopt;
  }
  /// What a motion has stored, and all that moves.
  [[nodiscard]] double energy_along_j(const LinearBall::Mode& mode) const {
    return world_.measure(0).kinetic_j + ball_.stored_j(mode, physics::positions_of(world_));
  }

 private:
  static physics::Scene scene(const LinearBall& ball, const SmallRun& run, const Eigen::VectorXd& direction) {
    physics::Scene scene = ball.scene(run.stiffness_n_m, run.damping_n_s_m, direction, displacement_m);
    const double substeps = std::max(1.0, std::ceil(1e-3 / run.step_s * (1.0 - 1e-12)));
    scene.stepping.integrator = run.integrator;
    scene.stepping.substeps = static_cast<std::uint32_t>(substeps);
    scene.stepping.rate_hz = std::min(1000.0, 1.0 / (run.step_s * substeps));
    scene.stepping.error_target = 1e-9;  // what a linear solve leaves is not to be seen
    return scene;
  }

  const LinearBall& ball_;
  physics::World world_;
  physics::Workers one_thread_{1};
};

}  // namespace

double growth_1_s(const LinearBall& ball, const SmallRun& run, const Eigen::VectorXd& direction, double duration_s) {
  DisplacedBall displaced(ball, run, direction);
  const int ticks = std::max(8, static_cast<int>(std::lround(duration_s / displaced.tick_s())));
  const int quarter = ticks / 4;
  const double start_j = *displaced.energy_j();
  double first_j = start_j;
  double last_j = 0.0;
  for (int tick = 1; tick <= ticks; ++tick) {
    displaced.step_tick();
    const std::optional<double> energy_j = displaced.energy_j();
    if (!energy_j || *energy_j > ran_away * start_j) return std::numeric_limits<double>::infinity();
    if (tick < quarter) first_j = std::max(first_j, *energy_j);
    if (tick > ticks - quarter) last_j = std::max(last_j, *energy_j);
  }
  const double apart_s = (ticks - quarter + 1) * displaced.tick_s();
  return 0.5 * std::log(last_j / first_j) / apart_s;
}

double breathing_left(const LinearBall& ball, const SmallRun& run) {
  const LinearBall::Mode mode = ball.breathing(run.stiffness_n_m);
  DisplacedBall displaced(ball, run, mode.direction);
  const double before_j = displaced.energy_along_j(mode);
  const double until_s = breathing_periods * 2.0 * std::numbers::pi / mode.frequency_rad_s;
  const int ticks = std::max(1, static_cast<int>(std::ceil(until_s / displaced.tick_s())));
  for (int tick = 0; tick < ticks; ++tick) displaced.step_tick();
  return displaced.energy_along_j(mode) / before_j;
}

Eigen::VectorXd every_motion(const LinearBall& ball) {
  // Weyl's golden-ratio sequence.
  Eigen::VectorXd direction(static_cast<Eigen::Index>(3 * ball.vertex_count()));
  double phase = 0.0;
  for (double& component : direction) component = 2.0 * std::fmod(phase += std::numbers::phi, 1.0) - 1.0;
  return direction;
}

}  // namespace pneuma::report
