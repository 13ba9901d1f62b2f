// Error against run time, of every method on a set of scenes.
#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <string_view>

#include "numerics/report/methods.h"
#include "numerics/report/part.h"
#include "numerics/report/precision_peers.h"
#include "numerics/report/precision_plots.h"
#include "numerics/report/precision_words.h"
#include "physics/choice/step_choice.h"

namespace pneuma::report {
namespace {

using namespace precision;

// Shares of the part's time, about.
constexpr double references_share = 0.15;
constexpr double errors_share = 0.35;

std::vector<Measured> begin(bool quick) {
  std::vector<Measured> all;
  for (Case& subject : all_cases(quick)) {
    Measured& measured = all.emplace_back();
    measured.runs = make_ladder(subject, quick);
    measured.subject = std::move(subject);
  }
  return all;
}

void measure_errors(std::vector<Measured>& all, Context& context) {
  std::mutex one_at_a_time;
  std::size_t references = 0;
  context.workers.for_each(all.size(), [&](std::size_t i) {
    Measured& measured = all[i];
    measured.reference = make_reference(measured.subject);
    measured.standstill = standstill_of(measured.subject, measured.reference.trajectory);
    const std::scoped_lock lock(one_at_a_time);
    context.progress.advance(references_share * static_cast<double>(++references) / static_cast<double>(all.size()));
  });
  std::vector<std::pair<const Measured*, Run*>> runs;
  for (Measured& measured : all) {
    for (Run& run : measured.runs) runs.emplace_back(&measured, &run);
  }
  std::size_t done = 0;
  context.workers.for_each(runs.size(), [&](std::size_t i) {
    const auto& [measured, run] = runs[i];
    measure_error(*run, measured->subject, measured->reference.trajectory);
    const std::scoped_lock lock(one_at_a_time);
    context.progress.advance(references_share +
                             errors_share * static_cast<double>(++done) / static_cast<double>(runs.size()));
  });
}

void add_peers(std::vector<Measured>& all) {
  for (const RestingBall& ball : resting_balls()) {
    const auto measured =
        std::ranges::find_if(all, [&](const Measured& each) { return each.subject.name == ball.name; });
    const double rest_m3 = measured->reference.trajectory.samples.back().soft.front().volume_m3;
    measured->peers = bullet_peers(ball, rest_m3);
  }
}

void measure_times(std::vector<Measured>& all, Context& context) {
  double share = references_share + errors_share;
  const double left = (1.0 - share) / static_cast<double>(all.size());
  for (Measured& measured : all) {
    std::vector<Timed> timed = timed_runs(measured.subject, measured.runs);
    for (const RestingBall& ball : resting_balls()) {
      if (ball.name == measured.subject.name)
        std::ranges::move(timed_peers(ball, measured.peers), back_inserter(timed));
    }
    std::size_t done = 0;
    take_times(timed, context.quick, [&] {  // the first round is the longest
      const double rounds = static_cast<double>(++done) / static_cast<double>(timed.size());
      context.progress.advance(share + left * std::min(1.0, 0.7 * rounds));
    });
    share += left;
    context.progress.advance(share);
  }
}

void write_csv(const std::vector<Measured>& all, const Context& context) {
  Csv csv = context.csv("work-precision",
                        {"case", "integrator", "auto", "substeps", "newton_iterations", "error_target", "precision",
                         "cpu_ms_per_s", "failure", "position", "centre_of_mass", "volume", "energy", "momentum",
                         "angular_momentum", "period", "volume_at_rest", "radius_at_rest"});
  for (const Measured& measured : all) {
    for (const Run& run : measured.runs) {
      const Setting& setting = run.setting;
      std::vector<Csv::Cell> row{measured.subject.name,
                                 std::string(physics::name_of(setting.integrator)),
                                 run.chosen ? 1.0 : 0.0,
                                 static_cast<double>(setting.substeps),
                                 static_cast<double>(setting.newton_iterations),
                                 setting.error_target,
                                 std::string(run.is_double() ? "double" : "single"),
                                 run.cpu_ms_per_s,
                                 run.failure};
      const Errors& errors = run.errors;
      for (const double error :
           {errors.position, errors.centre, errors.volume, errors.energy, errors.momentum, errors.angular_momentum,
            errors.period, errors.volume_at_rest, errors.radius_at_rest}) {
        row.push_back(std::isnan(error) ? Csv::Cell(std::string()) : Csv::Cell(error));
      }
      csv.row(row);
    }
  }
  Csv peers = context.csv("work-precision-bullet", {"case", "iterations", "cpu_ms_per_s", "volume_at_rest"});
  for (const Measured& measured : all) {
    for (const Peer& peer : measured.peers) {
      peers.row({measured.subject.name, static_cast<double>(peer.iterations), peer.cpu_ms_per_s, peer.volume_error});
    }
  }
}

constexpr std::string_view no_reference = "Its reference did not converge, and its errors say nothing.";

std::string caption(const Measured& measured, const Judged& judged) {
  if (!measured.reference.converged) return "**Invalid**: " + judged.title + ". " + std::string(no_reference);
  std::string text = judged.title + ": " + measured.subject.words + ". ";
  const Run* cheapest = cheapest_within(measured, judged, 0.01);
  if (cheapest == nullptr) return text + "No run came within 1 %.";
  return text + "Cheapest within 1 %: " + describe(*cheapest) + ".";
}

// No finer than what another compiler's or library's last bits may change.
std::string decade(double error) {
  if (!std::isfinite(error)) return "failed";
  const int exponent = static_cast<int>(std::ceil(std::log10(std::max(error, 1e-9))));
  return std::string("1e").append(std::to_string(exponent));
}

void add_outcomes(const Measured& measured, const Judged& judged, std::vector<Outcome>& outcomes) {
  for (const physics::Integrator integrator : every_integrator) {
    std::string row = "precision " + judged.name + ' ' + std::string(physics::name_of(integrator)) + " at";
    std::string outcome;
    for (const Run& run : measured.runs) {
      if (!run.is_plain() || run.setting.integrator != integrator) continue;
      row += ' ' + std::to_string(run.setting.substeps);
      outcome.append(outcome.empty() ? "" : " ").append(decade(run.judged(judged.error)));
    }
    outcomes.push_back({row, measured.reference.converged ? outcome : "no reference"});
  }
  const Run& chosen = automatic(measured);
  std::string choice(physics::name_of(chosen.setting.integrator));
  choice.append(" ").append(std::to_string(chosen.setting.substeps)).append(" ");
  choice.append(measured.reference.converged ? decade(chosen.judged(judged.error)) : "no reference");
  outcomes.push_back({"precision " + judged.name + " AUTO", choice});
}

void run_work_precision(Context& context) {
  std::vector<Measured> all = begin(context.quick);
  measure_errors(all, context);
  add_peers(all);
  measure_times(all, context);

  write_csv(all, context);
  const std::vector<Verdict> rows = verdicts(all);
  Page& page = context.page;
  page.heading("Error against run time");
  page.paragraph(
      "Each scene below is run with every method over a ladder of steps, and compared at every tick with a converged "
      "solution. Errors of motion are distances in body sizes: the largest side of the body's bounding box. One "
      "thread, 60 ticks a second, double precision; medians of interleaved runs.");
  for (const Measured& measured : all) {
    if (measured.reference.converged) continue;
    const std::string invalid = "invalid: " + measured.subject.judged.front().title + ". " + std::string(no_reference);
    page.paragraph("**Partly i" + invalid.substr(1) + "**");
    context.faults.push_back(invalid);
  }
  write_advice(page, rows);
  write_verdicts(page, rows);
  page.subheading("The ladders");
  page.paragraph(
      std::string(
          "Further down is more exact, further left is faster. Each line is a method's ladder: the same scene at "
          "more and more substeps, for Bullet 1 to 50 iterations. What failed (a body froze, or was more than its "
          "size off) stands above the top line, at the time that such steps take where they hold. Dotted lines: "
          "the error of a body that does not move at all, and the reference's own. Errors under 1e-9 are drawn "
          "at 1e-9.")
          .append(context.quick ? "" : " Dashed lines without marks: four Newton iterations a step, solved to 1e-6."));
  for (const Measured& measured : all) {
    for (const Judged& judged : measured.subject.judged) {
      context.figure("precision-" + judged.name, diagram(measured, judged), caption(measured, judged));
      add_outcomes(measured, judged, context.outcomes);
    }
  }
  context.figure("precision-single", precision_diagram(all),
                 "RK4 in single precision: faster, until round-off ends its line.");
  write_measures(page, all);
  write_peers(page, all);
  write_references(page, all);
}

}  // namespace

Part work_precision() {
  return {.name = "work-precision",
          .title = "Error against run time",
          .quick_s = 30.0,
          .full_s = 250.0,
          .run = run_work_precision};
}

}  // namespace pneuma::report
