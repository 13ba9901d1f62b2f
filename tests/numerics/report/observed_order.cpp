#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "numerics/known_scenes.h"
#include "numerics/report/methods.h"
#include "numerics/report/part.h"
#include "physics/choice/step_choice.h"

namespace pneuma::report {
namespace {

using physics::Integrator;

constexpr double ladder_s = 1.0 / 30.0;
constexpr std::uint32_t substeps_min = 4;
constexpr std::uint32_t substeps_max = 2048;
constexpr std::uint32_t reference_substeps = 4096;
constexpr std::size_t fitted = 4;          // rungs of a ladder, its finest
constexpr double above_round_off = 100.0;  // times the reference's own error

struct OrderCase {
  std::string name;    // in words
  std::string figure;  // its plot and CSV file
  physics::Scene scene;
};

std::array<OrderCase, 3> order_cases() {
  const auto icosahedron = [](double damping_n_s_m) {
    return physics::BreathingBall{.damping_n_s_m = damping_n_s_m}.scene(1.0, Integrator::rk4, 30, 1);
  };
  return {{{"undamped", "order-undamped", icosahedron(0.0)},
           {"damped", "order-damped", icosahedron(2.0)},
           {"all forces", "order-all-forces", physics::all_forces_scene()}}};
}

struct Ladder {
  std::vector<std::pair<double, double>> points;  // step in s, error in m
  double order = 0.0;
};

/// The slope of log error over log step, by least squares over the finest steps whose errors are above `floor_m`.
double order_of(const std::vector<std::pair<double, double>>& points, double floor_m) {
  std::vector<std::pair<double, double>> finest;
  for (const auto& [step_s, error_m] : points) {  // the coarsest first
    if (error_m > floor_m) finest.emplace_back(std::log(step_s), std::log(error_m));
  }
  if (finest.size() > fitted) finest.erase(finest.begin(), finest.end() - fitted);
  double x_mean = 0.0;
  double y_mean = 0.0;
  for (const auto& [x, y] : finest) {
    x_mean += x / static_cast<double>(finest.size());
    y_mean += y / static_cast<double>(finest.size());
  }
  double across = 0.0;
  double along = 0.0;
  for (const auto& [x, y] : finest) {
    across += (x - x_mean) * (y - y_mean);
    along += (x - x_mean) * (x - x_mean);
  }
  return across / along;
}

struct CaseResult {
  std::array<Ladder, every_integrator.size()> ladders;
  double reference_error_m = 0.0;
};

CaseResult measure(const OrderCase& each, physics::Workers& workers) {
  const std::vector<physics::Vec3d> exact = physics::after_a_thirtieth(each.scene, Integrator::rk4, reference_substeps);
  CaseResult result;
  result.reference_error_m =
      physics::distance_m(exact, physics::after_a_thirtieth(each.scene, Integrator::rk4, reference_substeps / 2));
  workers.for_each(every_integrator.size(), [&](std::size_t i) {
    Ladder& ladder = result.ladders[i];
    for (std::uint32_t substeps = substeps_min; substeps <= substeps_max; substeps *= 2) {
      ladder.points.emplace_back(
          ladder_s / substeps,
          physics::distance_m(physics::after_a_thirtieth(each.scene, every_integrator[i], substeps), exact));
    }
    ladder.order = order_of(ladder.points, above_round_off * result.reference_error_m);
  });
  return result;
}

void draw(Context& context, const OrderCase& each, const CaseResult& result, const std::string& caption) {
  Plot plot;
  plot.title = std::string("Error after 1/30 s, ").append(each.name);
  plot.x = {.label = "step (s)", .log = true, .range = {1e-5, 1e-2}};
  plot.y = {.label = "RMS error of the vertices (m)", .log = true, .range = {1e-16, 1.0}};
  Csv csv = context.csv(each.figure, {"integrator", "step_s", "rms_error_m"});
  for (std::size_t i = 0; i < every_integrator.size(); ++i) {
    const std::string title = title_of(every_integrator[i]);
    plot.series.push_back({.label = title, .style = style_of(every_integrator[i]), .points = result.ladders[i].points});
    for (const auto& [step_s, error_m] : result.ladders[i].points) csv.row({title, step_s, error_m});
  }
  // A fan of guides below all measured lines.
  const double from_s = 8e-3;
  const double to_s = 1e-3;
  const double from_m = 2e-9;
  for (const int slope : {1, 2, 4}) {
    const double to_m = from_m * std::pow(to_s / from_s, slope);
    plot.series.push_back({.label = "", .style = 8, .points = {{to_s, to_m}, {from_s, from_m}}, .mark = Mark::dashed});
    plot.commands.push_back(std::string("set label 'order ")
                                .append(std::to_string(slope))
                                .append("' at ")
                                .append(number(to_s * 0.95))
                                .append(",")
                                .append(number(to_m))
                                .append(" right tc rgb '#404040'"));
  }
  context.figure(each.figure, plot, caption);
}

void run_observed_order(Context& context) {
  context.page.heading("Observed order");
  context.page.paragraph(
      "An integrator of order p divides its error by 2^p when the step is halved. Here each one moves a ball for 1/30 "
      "s "
      "by steps from 1/120 s to 1/61,440 s. The slope of its error over the step, by least squares over the four "
      "finest "
      "steps above round-off, is its observed order. Where it is what theory says, the forces and the method fit "
      "together, and a line can be read on to other steps: for a tenth of the error, a method of order 1 needs 10 "
      "times "
      "the steps, one of order 2 needs 3.2 times, RK4 1.8 times.");
  const std::array<OrderCase, 3> cases = order_cases();
  std::array<CaseResult, 3> results;
  for (std::size_t c = 0; c < cases.size(); ++c) {
    results[c] = measure(cases[c], context.workers);
    context.progress.advance(static_cast<double>(c + 1) / static_cast<double>(cases.size()));
  }
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < every_integrator.size(); ++i) {
    const Integrator integrator = every_integrator[i];
    std::vector<std::string> row{title_of(integrator), number(physics::order_of(integrator))};
    for (std::size_t c = 0; c < cases.size(); ++c) {
      const double order = results[c].ladders[i].order;
      row.push_back(fixed(order, 2));
      context.outcomes.push_back(
          {std::string("order ").append(physics::name_of(integrator)).append(" ").append(cases[c].name),
           fixed(order, 1)});
    }
    for (const std::size_t rung : {std::size_t{4}, std::size_t{7}}) {
      row.push_back(number(results[1].ladders[i].points[rung].second, 2));
    }
    rows.push_back(std::move(row));
  }
  context.page.table({"integrator", "theory", "undamped", "damped", "all forces", "error at 1/1,920 s, damped (m)",
                      "at 1/15,360 s (m)"},
                     rows);
  double reference_error_m = 0.0;
  for (const CaseResult& result : results) reference_error_m = std::max(reference_error_m, result.reference_error_m);
  context.page.paragraph(
      std::string("Undamped and damped: an icosahedron of radius 0.5 m let go at its springs' rest "
                  "lengths, swelling by its gas. All forces: a 42-vertex ball with gravity, wind, an "
                  "outside pressure, bending, adiabatic gas, damping, spin and a pinned vertex. "
                  "Exact is RK4 by 4,096 steps; by half as many it is off by at most ")
          .append(number(reference_error_m, 2))
          .append(" m."));
  draw(context, cases[1], results[1],
       "Error over step on the damped icosahedron. A line's slope is the order; RK4 ends at round-off.");
  draw(context, cases[2], results[2],
       "Error over step with every force at once: a force of lower order than its method would bend a line.");
}

}  // namespace

Part observed_order() {
  return {
      .name = "observed-order", .title = "Observed order", .quick_s = 4.0, .full_s = 4.0, .run = run_observed_order};
}

}  // namespace pneuma::report
