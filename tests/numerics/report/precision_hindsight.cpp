#include "numerics/report/precision_hindsight.h"

#include <algorithm>
#include <cmath>

#include "numerics/report/methods.h"
#include "numerics/report/page.h"

namespace pneuma::report::precision {

const Run* cheapest_within(const Measured& measured, const Judged& judged, double error) {
  const Run* best = nullptr;
  for (const Run& run : measured.runs) {
    const double off = run.judged(judged.error);
    if (run.chosen || !run.is_double() || !std::isfinite(off) || off > error) continue;
    if (best == nullptr || run.cpu_ms_per_s < best->cpu_ms_per_s) best = &run;
  }
  return best;
}

const Run& automatic(const Measured& measured) {
  return *std::ranges::find_if(measured.runs,
                               [](const Run& run) { return run.chosen && run.setting.error_target == default_target; });
}

std::vector<Verdict> verdicts(const std::vector<Measured>& all) {
  std::vector<Verdict> rows;
  for (const Measured& measured : all) {
    if (!measured.reference.converged) continue;
    const Run& chosen = automatic(measured);
    for (const Judged& judged : measured.subject.judged) {
      const double error = chosen.judged(judged.error);
      const double known = 3.0 * measured.reference.halving.*judged.error;
      rows.push_back({.measured = &measured,
                      .judged = &judged,
                      .automatic = &chosen,
                      .error = error,
                      .within_percent = cheapest_within(measured, judged, 0.01),
                      .within_per_mille = cheapest_within(measured, judged, 0.001),
                      .as_exact = cheapest_within(measured, judged, std::max({error, 1e-4, known}))});
    }
  }
  return rows;
}

std::string describe(const Run& run) {
  std::string text = title_of(run.setting.integrator);
  text.append(", ").append(std::to_string(run.setting.substeps));
  text.append(run.setting.substeps == 1 ? " substep" : " substeps");
  if (run.setting.newton_iterations > 1) {
    text.append(", ").append(std::to_string(run.setting.newton_iterations)).append(" iterations");
  }
  return text;
}

std::string milliseconds(double cpu_ms_per_s) {
  return number(cpu_ms_per_s, 2) + " ms";
}

std::string share(double error) {
  constexpr double least = 1e-6;
  if (std::isfinite(error) && error > 10.0) return number(error, 2) + " times";
  return error < least ? "under " + percent(least) : percent(error);
}

}  // namespace pneuma::report::precision
