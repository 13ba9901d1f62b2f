// Runs of a case: with one method and step, in a ladder of them, and the reference that they are measured against.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "numerics/report/precision_cases.h"

namespace pneuma::report::precision {

// What linear and Newton solves are ended by: as scenes have it, and where it is not to be seen.
inline constexpr double default_target = 0.01;
inline constexpr double tight_target = 1e-6;

struct Setting {
  physics::Integrator integrator = physics::Integrator::rk4;
  std::uint32_t substeps = 0;  // a tick; 0: the engine's choice
  std::uint32_t newton_iterations = 1;
  double error_target = default_target;
  physics::Precision precision = physics::Precision::double_precision;
};

/// One setting's run of a case.
struct Run {
  Setting setting;      // as it was taken: integrator and substeps are those chosen
  bool chosen = false;  // by AUTO
  std::string reason;   // why
  std::string failure;  // empty: none
  Errors errors;
  double cpu_ms_per_s = 0.0;  // of simulated time

  [[nodiscard]] bool is_double() const { return setting.precision == physics::Precision::double_precision; }
  /// With all else as scenes have it: a rung of the ladder of steps.
  [[nodiscard]] bool is_plain() const { return is_double() && !chosen && setting.error_target == default_target; }
  /// The error by which a case is judged; infinite where the run failed, or ended further off than all it could have
  /// kept.
  [[nodiscard]] double judged(double Errors::* error) const {
    return failure.empty() && errors.*error <= 1.0 ? errors.*error : std::numeric_limits<double>::infinity();
  }
};

/// A world of the case at its start, with steps as asked, stable or not; `rate` times as many ticks.
[[nodiscard]] physics::World start(const Case& subject, const Setting& setting, std::uint32_t rate = 1);

struct Reference {
  Trajectory trajectory;
  std::uint32_t substeps = 0;  // of RK4 in 1/60 s
  Errors halving;              // how far it is from the one with steps twice as long
  double energy_drift = 0.0;   // of its energy, in its most kinetic energy
  bool converged = false;      // by the case's first measure, to reference_change_max
};
inline constexpr double reference_change_max = 1e-9;
[[nodiscard]] Reference make_reference(const Case& subject);

/// A rigid-body engine's soft body beside ours.
struct Peer {
  int iterations = 0;
  double volume_error = 0.0;  // at rest
  double cpu_ms_per_s = 0.0;
};

/// A case with all that is measured of it.
struct Measured {
  Case subject;
  Reference reference;
  Errors standstill;  // of bodies that stay as they were let go
  std::vector<Run> runs;
  std::vector<Peer> peers;
};

/// Every method's ladder of steps, and of Newton iterations; AUTO's choices for two targets; RK4 in single precision
/// where the case asks for it.
[[nodiscard]] std::vector<Run> make_ladder(const Case& subject, bool quick);

/// Fills in the errors of one run.
void measure_error(Run& run, const Case& subject, const Trajectory& reference);
[[nodiscard]] Errors standstill_of(const Case& subject, const Trajectory& reference);

/// What is timed, and what its time is written to.
struct Timed {
  std::function<void()> run;
  double simulated_s = 0.0;
  double* cpu_ms_per_s = nullptr;
};
/// Runs of the case from its start; worlds are set up before they are timed. `runs` must stay where they are.
[[nodiscard]] std::vector<Timed> timed_runs(const Case& subject, std::vector<Run>& runs);
/// Runs them in turns (timing.h); `between` is called between runs.
void take_times(const std::vector<Timed>& timed, bool quick, const std::function<void()>& between);

}  // namespace pneuma::report::precision
