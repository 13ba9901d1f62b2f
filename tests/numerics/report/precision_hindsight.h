// What a case would have been run with, had its errors and times been known before.
#pragma once

#include <string>

#include "numerics/report/precision_runs.h"

namespace pneuma::report::precision {

/// The quickest run in double precision, AUTO's aside, whose error is at most so much; null: none.
[[nodiscard]] const Run* cheapest_within(const Measured& measured, const Judged& judged, double error);

/// AUTO's, for the target that scenes have unless they say otherwise.
[[nodiscard]] const Run& automatic(const Measured& measured);

/// A row of the tables: one case by one measure.
struct Verdict {
  const Measured* measured = nullptr;
  const Judged* judged = nullptr;
  const Run* automatic = nullptr;
  double error = 0.0;                   // AUTO's
  const Run* within_percent = nullptr;  // the cheapest
  const Run* within_per_mille = nullptr;
  const Run* as_exact = nullptr;  // as AUTO, or within 1e-4 or thrice what the reference knows

  [[nodiscard]] bool holds_target() const { return error <= default_target; }
  /// AUTO's time in times of another run.
  [[nodiscard]] double ratio_to(const Run* run) const { return automatic->cpu_ms_per_s / run->cpu_ms_per_s; }
};
/// Of the cases whose reference converged.
[[nodiscard]] std::vector<Verdict> verdicts(const std::vector<Measured>& all);

/// "midpoint, 16 substeps".
[[nodiscard]] std::string describe(const Run& run);
/// "160 ms", of CPU time in a simulated second.
[[nodiscard]] std::string milliseconds(double cpu_ms_per_s);
/// "0.53 %", and no more than that it is small where nobody would ask.
[[nodiscard]] std::string share(double error);

}  // namespace pneuma::report::precision
