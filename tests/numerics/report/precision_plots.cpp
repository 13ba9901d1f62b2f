#include "numerics/report/precision_plots.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "numerics/report/methods.h"

namespace pneuma::report::precision {

using physics::Integrator;

namespace {

constexpr double least_error = 1e-9;  // what is smaller is shown as this: the reference says no more
constexpr double failed_at = 1e3;     // until the height of the plot is known
constexpr int bullet_style = 8;
constexpr const char* time_label = "CPU time (ms a simulated second)";

// A run that failed stopped early. What its steps cost where they hold, from the nearest of its method, or else of
// symplectic Euler, which evaluates as many forces as the one method that may never hold.
double shown_ms(const Run& failed, const std::vector<Run>& runs) {
  for (const Integrator integrator : {failed.setting.integrator, Integrator::symplectic_euler}) {
    const auto holds = std::ranges::find_if(runs, [&](const Run& run) {
      return run.is_plain() && run.failure.empty() && run.setting.integrator == integrator;
    });
    if (holds == runs.end()) continue;
    return holds->cpu_ms_per_s * failed.setting.substeps / holds->setting.substeps;
  }
  return failed.cpu_ms_per_s;
}

class Diagram {
 public:
  Diagram(const std::string& title, const std::string& label) {
    plot_.title = title;
    plot_.x = {.label = time_label, .log = true};
    plot_.y = {.label = label, .log = true};
  }

  void add(Series series) {
    std::ranges::sort(series.points);
    for (auto& [time_ms, error] : series.points) {
      error = std::max(error, least_error);
      least_ = std::min(least_, error);
      any_failed_ |= error == failed_at;
    }
    if (!series.points.empty()) plot_.series.push_back(std::move(series));
  }

  /// What a method failed at, at failed_at, stands above a line, its method in the key if nothing else of it is.
  void add_failed(Series series, bool in_key) {
    if (series.points.empty()) return;
    if (!in_key) series.label.clear();
    series.mark = Mark::points;
    plot_.series.push_back(std::move(series));
    any_failed_ = true;
  }

  enum class Side { left, right };
  /// A line across, with words by it.
  void level(double error, const std::string& words, Side side) {
    if (!(error >= least_error)) return;
    least_ = std::min(least_, error);
    const bool below = error > 0.2 && error < 1.0;  // above would be among what failed
    std::ostringstream line;
    line << "set arrow from graph 0, first " << error << " to graph 1, first " << error
         << " nohead dt 3 lw 2 lc rgb '#404040'\nset label \"" << words << "\" at graph "
         << (side == Side::left ? "0.01" : "0.99") << ", first " << error << (side == Side::left ? " left" : " right")
         << " offset 0," << (below ? "-0.6" : "0.6") << " front boxed tc rgb '#404040'";
    plot_.commands.push_back(line.str());
  }

  [[nodiscard]] Plot plot() && {
    plot_.y.range = {0.5 * least_, 1.0};
    if (!any_failed_) return plot_;
    // Marks stand just above the line, words at the top.
    constexpr double line = 1.7;
    constexpr double band = 0.22;  // of the height below the line
    const double height = line / plot_.y.range.first;
    const double marks = line * std::pow(height, 0.3 * band);
    plot_.y.range.second = line * std::pow(height, band);
    for (Series& series : plot_.series) {
      for (auto& [time_ms, error] : series.points) {
        if (error == failed_at) error = marks;
      }
    }
    level(line, "", Side::right);
    plot_.commands.emplace_back(
        "set label \"failed: above this line\" at graph 0.99, graph 0.96 right tc rgb '#404040'");
    return plot_;
  }

 private:
  Plot plot_;
  double least_ = 1.0;
  bool any_failed_ = false;
};

/// The runs of one method, and apart from them those that failed.
struct Ladder {
  Series holds;
  Series failed;

  void draw(Diagram& diagram) && {
    const bool none_holds = holds.points.empty();
    diagram.add(std::move(holds));
    diagram.add_failed(std::move(failed), none_holds);
  }
};

Ladder ladder_of(Integrator integrator, const Measured& measured, const Judged& judged) {
  const int style = style_of(integrator);
  Ladder ladder{.holds{.label = title_of(integrator), .style = style, .points{}},
                .failed{.label = title_of(integrator), .style = style, .points{}}};
  for (const Run& run : measured.runs) {
    if (!run.is_plain() || run.setting.integrator != integrator) continue;
    const double error = run.judged(judged.error);
    if (std::isfinite(error)) {
      ladder.holds.points.emplace_back(run.cpu_ms_per_s, error);
    } else {
      ladder.failed.points.emplace_back(run.failure.empty() ? run.cpu_ms_per_s : shown_ms(run, measured.runs),
                                        failed_at);
    }
  }
  return ladder;
}

Series tightly_solved(Integrator integrator, const Measured& measured, const Judged& judged) {
  Series series{.label = "", .style = style_of(integrator), .points{}, .mark = Mark::dashed};
  for (const Run& run : measured.runs) {
    if (run.setting.integrator != integrator || run.setting.newton_iterations != 4) continue;
    if (const double error = run.judged(judged.error); std::isfinite(error)) {
      series.points.emplace_back(run.cpu_ms_per_s, error);
    }
  }
  return series;
}

Series chosen(const Measured& measured, const Judged& judged) {
  Series series{.label = "AUTO", .style = style_of(Integrator::automatic), .points{}, .mark = Mark::points};
  for (const Run& run : measured.runs) {
    if (!run.chosen || run.setting.error_target != default_target) continue;
    const double error = run.judged(judged.error);
    series.points.emplace_back(run.cpu_ms_per_s, std::isfinite(error) ? error : failed_at);
  }
  return series;
}

Ladder bullet(const Measured& measured) {
  Ladder ladder{.holds{.label = "Bullet", .style = bullet_style, .points{}},
                .failed{.label = "Bullet", .style = bullet_style, .points{}}};
  for (const Peer& peer : measured.peers) {
    const bool holds = peer.volume_error <= 1.0;
    (holds ? ladder.holds : ladder.failed)
        .points.emplace_back(peer.cpu_ms_per_s, holds ? peer.volume_error : failed_at);
  }
  return ladder;
}

}  // namespace

Plot diagram(const Measured& measured, const Judged& judged) {
  Diagram diagram(measured.reference.converged ? judged.title : "INVALID: " + judged.title, judged.label);
  for (const Integrator integrator : every_integrator) {
    ladder_of(integrator, measured, judged).draw(diagram);
  }
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2}) {
    diagram.add(tightly_solved(integrator, measured, judged));
  }
  bullet(measured).draw(diagram);
  diagram.add(chosen(measured, judged));
  if (const double error = measured.standstill.*judged.error; error <= 1.0) {
    diagram.level(error, "error of not moving at all", Diagram::Side::right);
  }
  diagram.level(measured.reference.halving.*judged.error, "the reference's own error", Diagram::Side::left);
  return std::move(diagram).plot();
}

Plot precision_diagram(const std::vector<Measured>& all) {
  Diagram diagram("RK4 in single and in double precision", "RMS position error / body size");
  int style = 1;
  for (const Measured& measured : all) {
    if (!measured.subject.in_single_too) continue;
    for (const bool in_double : {true, false}) {
      const Judged& judged = measured.subject.judged.front();
      Series series{.label = judged.title + (in_double ? ", double" : ", single"), .style = style, .points{}};
      for (const Run& run : measured.runs) {
        if (run.chosen || run.setting.integrator != Integrator::rk4 || run.is_double() != in_double) continue;
        if (const double error = run.judged(judged.error); std::isfinite(error)) {
          series.points.emplace_back(run.cpu_ms_per_s, error);
        }
      }
      diagram.add(std::move(series));
      style += in_double ? 4 : -2;
    }
  }
  return std::move(diagram).plot();
}

}  // namespace pneuma::report::precision
