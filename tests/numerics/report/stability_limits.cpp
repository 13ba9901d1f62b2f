#include "numerics/report/stability_limits.h"

#include <algorithm>
#include <cmath>

#include "numerics/report/methods.h"
#include "numerics/report/small_motions.h"
#include "physics/choice/longest_step.h"
#include "physics/choice/stability.h"
#include "physics/choice/step_choice.h"

namespace pneuma::report {
namespace {

using physics::Integrator;

constexpr std::array<Integrator, 4> explicit_integrators{Integrator::explicit_euler, Integrator::midpoint,
                                                         Integrator::rk4, Integrator::symplectic_euler};
constexpr double damping_n_s_m = 0.1;
constexpr double steps_max = 5000.0;  // of a run, which takes a second at most
constexpr double bracket = 4.0;       // the search begins at so many times the theory's step, and ends at its inverse
constexpr int halvings = 9;           // to 0.5 %
constexpr double agreement_max = 0.1;

struct Limit {
  Integrator integrator = Integrator::rk4;
  double stiffness_n_m = 0.0;
  double damping_n_s_m = 0.0;
  double theory_s = 0.0;
  double measured_s = 0.0;  // 0: past what a world can be given
  double refused_s = 0.0;   // past which the server refuses
};

void measure(const LinearBall& ball, Limit& limit) {
  limit.theory_s = ball.stability_limit_s(limit.integrator, limit.stiffness_n_m, limit.damping_n_s_m);
  const physics::Scene scene = ball.scene(limit.stiffness_n_m, limit.damping_n_s_m, every_motion(ball), 0.0);
  limit.refused_s = physics::stability_limit_s(limit.integrator,
                                               physics::estimate_frequencies(scene.soft_bodies[0], scene.atmosphere));
  double below_s = limit.theory_s / bracket;
  double above_s = limit.theory_s * bracket;
  if (below_s < step_min_s) return;
  const std::array<Eigen::VectorXd, 3> directions{ball.fastest(limit.stiffness_n_m).direction,
                                                  ball.fastest_of_springs(limit.stiffness_n_m).direction,
                                                  ball.breathing(limit.stiffness_n_m).direction};
  for (int i = 0; i < halvings; ++i) {
    const double step_s = std::sqrt(below_s * above_s);
    const SmallRun run{limit.integrator, limit.stiffness_n_m, limit.damping_n_s_m, step_s};
    const bool grows = std::ranges::any_of(directions, [&](const Eigen::VectorXd& direction) {
      return growth_1_s(ball, run, direction, std::min(1.0, steps_max * step_s)) > growth_max_1_s;
    });
    (grows ? above_s : below_s) = step_s;
  }
  limit.measured_s = std::sqrt(below_s * above_s);
}

std::vector<Limit> measure_all(Context& context, const LinearBall& ball, double begun, double ended) {
  const std::vector<double> exponents =
      context.quick ? std::vector<double>{0.0, 4.0} : std::vector<double>{0.0, 2.0, 4.0, 6.0, 8.0};
  std::vector<Limit> limits;
  for (const double damping : {0.0, damping_n_s_m}) {
    for (const Integrator integrator : explicit_integrators) {
      for (const double exponent : exponents) {
        limits.push_back(
            {.integrator = integrator, .stiffness_n_m = std::pow(10.0, exponent), .damping_n_s_m = damping});
      }
    }
  }
  for (std::size_t first = 0; first < limits.size(); first += exponents.size()) {
    context.workers.for_each(exponents.size(), [&](std::size_t i) { measure(ball, limits[first + i]); });
    const double share = static_cast<double>(first + exponents.size()) / static_cast<double>(limits.size());
    context.progress.advance(begun + share * (ended - begun));
  }
  return limits;
}

std::string stiffness_text(double stiffness_n_m) {
  return std::string("10^").append(fixed(std::log10(stiffness_n_m), 0));
}

void draw(Context& context, const LinearBall& ball, const std::vector<Limit>& limits, double damping) {
  Plot plot;
  plot.title = damping > 0.0 ? std::string("Longest stable step, damping ").append(number(damping)).append(" N s/m")
                             : std::string("Longest stable step, undamped");
  plot.x = {.label = "stiffness k (N/m)", .log = true, .range = {0.5, 2e8}};
  plot.y = {.label = "step (s)", .log = true, .range = {1e-7, 1.0}};
  for (const Integrator integrator : explicit_integrators) {
    Series theory{.label = "", .style = style_of(integrator), .points = {}, .mark = Mark::line};
    for (double exponent = 0.0; exponent <= 8.0; exponent += context.quick ? 1.0 : 0.25) {
      const double stiffness_n_m = std::pow(10.0, exponent);
      theory.points.emplace_back(stiffness_n_m, ball.stability_limit_s(integrator, stiffness_n_m, damping));
    }
    Series measured{.label = title_of(integrator), .style = style_of(integrator), .points = {}, .mark = Mark::points};
    for (const Limit& limit : limits) {
      if (limit.integrator == integrator && limit.damping_n_s_m == damping && limit.measured_s > 0.0) {
        measured.points.emplace_back(limit.stiffness_n_m, limit.measured_s);
      }
    }
    plot.series.push_back(std::move(theory));
    plot.series.push_back(std::move(measured));
  }
  context.figure(damping > 0.0 ? "stability-limits-damped" : "stability-limits-undamped", plot,
                 std::string(damping > 0.0 ? "Damped" : "Undamped")
                     .append(". Points: where the engine's motion begins to grow. Lines: theory."));
}

}  // namespace

void add_stability_limits(Context& context, const LinearBall& ball, double begun, double ended) {
  context.page.subheading("Where the explicit integrators stop being stable");
  context.page.paragraph(
      "The same ball, undamped and with 0.1 N s/m in each spring: the step past which a motion grows e-fold in a "
      "second "
      "or faster, found by bisection, over the step that theory gives. Theory is exact here: the eigenvalues of the "
      "whole "
      "stiffness matrix, put through each method's amplification factor. Undamped, with w the fastest motion in rad/s, "
      "symplectic Euler ends at 2/w and RK4 at 2.83/w; explicit Euler and midpoint grow at any step, and pass e-fold a "
      "second at about 2/w^2 and 2/w^(4/3).");
  const std::vector<Limit> limits = measure_all(context, ball, begun, ended);
  Csv csv = context.csv("stability-limits",
                        {"integrator", "stiffness_n_m", "damping_n_s_m", "theory_s", "measured_s", "refused_past_s"});
  std::vector<std::string> columns{"integrator", "damping (N s/m)"};
  std::vector<std::vector<std::string>> rows;
  double refused_least = 1e9;
  double refused_most = 0.0;
  for (const Limit& limit : limits) {
    const std::string title = title_of(limit.integrator);
    csv.row({title, limit.stiffness_n_m, limit.damping_n_s_m, limit.theory_s, limit.measured_s, limit.refused_s});
    const std::string damping = number(limit.damping_n_s_m);
    if (rows.empty() || rows.back()[0] != title || rows.back()[1] != damping) rows.push_back({title, damping});
    if (rows.size() == 1) columns.push_back(std::string("k = ").append(stiffness_text(limit.stiffness_n_m)));
    refused_least = std::min(refused_least, limit.refused_s / limit.theory_s);
    refused_most = std::max(refused_most, limit.refused_s / limit.theory_s);
    if (limit.measured_s == 0.0) {
      rows.back().emplace_back("-");
      continue;
    }
    const double ratio = limit.measured_s / limit.theory_s;
    rows.back().push_back(fixed(ratio, 3));
    context.outcomes.push_back({std::string("stability limit ")
                                    .append(physics::name_of(limit.integrator))
                                    .append(" k=")
                                    .append(stiffness_text(limit.stiffness_n_m))
                                    .append(" damping=")
                                    .append(damping),
                                std::abs(ratio - 1.0) <= agreement_max ? "within 10 %" : fixed(ratio, 2)});
  }
  context.page.paragraph("Measured over theoretical step:");
  context.page.table(columns, rows);
  context.page.paragraph(std::string("A dash: the step is shorter than a world can be given (2.4e-7 s). The server "
                                     "estimates the fastest motion by power iteration and refuses steps past ")
                             .append(fixed(refused_least, 2))
                             .append(" to ")
                             .append(fixed(refused_most, 2))
                             .append(" times the exact limit (on_unstable)."));
  for (const double damping : {0.0, damping_n_s_m}) draw(context, ball, limits, damping);
}

}  // namespace pneuma::report
