#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <sstream>

#include "numerics/amplification.h"
#include "numerics/report/methods.h"
#include "numerics/report/part.h"
#include "numerics/report/small_motions.h"
#include "numerics/report/stability_limits.h"
#include "physics/choice/longest_step.h"
#include "physics/choice/step_choice.h"

namespace pneuma::report {
namespace {

using physics::Integrator;

constexpr double duration_s = 1.0;
constexpr double left_min = 0.25;     // of the breathing's energy: half its amplitude
constexpr double limits_share = 0.3;  // of the part's time

enum class Cell : char { stable = 'S', damped = 'D', unstable = 'U' };

struct Grid {
  std::vector<double> stiffnesses_n_m;
  std::vector<int> rates_hz;  // one over the step, the longest step first
};

Grid grid_of(bool quick) {
  Grid grid;
  for (double exponent = 0.0; exponent <= 8.0; exponent += quick ? 2.0 : 0.5) {
    grid.stiffnesses_n_m.push_back(std::pow(10.0, exponent));
  }
  for (int rate_hz = 30; rate_hz <= 7680; rate_hz *= quick ? 4 : 2) grid.rates_hz.push_back(rate_hz);
  return grid;
}

constexpr auto xpbd_column =
    static_cast<std::size_t>(std::ranges::find(every_integrator, Integrator::xpbd) - every_integrator.begin());

/// [stiffness][rate]
using Map = std::vector<std::vector<Cell>>;

Cell find(const LinearBall& ball, const SmallRun& run) {
  const Eigen::VectorXd direction =
      physics::is_explicit(run.integrator) ? ball.fastest(run.stiffness_n_m).direction : every_motion(ball);
  if (growth_1_s(ball, run, direction, duration_s) > growth_max_1_s) return Cell::unstable;
  return breathing_left(ball, run) < left_min ? Cell::damped : Cell::stable;
}

Map map_of(const LinearBall& ball, const Grid& grid, Integrator integrator, physics::Workers& workers) {
  const std::size_t rates = grid.rates_hz.size();
  Map map(grid.stiffnesses_n_m.size(), std::vector<Cell>(rates));
  workers.for_each(map.size() * rates, [&](std::size_t i) {
    // The shortest steps first: they take longest.
    const std::size_t stiffness = i % map.size();
    const std::size_t rate = rates - 1 - i / map.size();
    map[stiffness][rate] = find(ball, {.integrator = integrator,
                                       .stiffness_n_m = grid.stiffnesses_n_m[stiffness],
                                       .step_s = 1.0 / grid.rates_hz[rate]});
  });
  return map;
}

/// The step past which breathing loses more than it may, of the implicit methods; 0 where no factor is known.
double damping_limit_s(const LinearBall& ball, Integrator integrator, double stiffness_n_m) {
  if (integrator != Integrator::implicit_euler && integrator != Integrator::tr_bdf2) return 0.0;
  const double frequency_rad_s = ball.breathing(stiffness_n_m).frequency_rad_s;
  double below = 1e-3;  // w h
  double above = 10.0;
  for (int i = 0; i < 40; ++i) {
    const double wh = std::sqrt(below * above);
    const double steps = breathing_periods * 2.0 * std::numbers::pi / wh;
    (std::pow(energy_growth(integrator, wh), steps) < left_min ? above : below) = wh;
  }
  return below / frequency_rad_s;
}

/// The limit that theory sets to an integrator; 0 where none is known.
double limit_s(const LinearBall& ball, Integrator integrator, double stiffness_n_m) {
  return physics::is_explicit(integrator) ? ball.stability_limit_s(integrator, stiffness_n_m, 0.0)
                                          : damping_limit_s(ball, integrator, stiffness_n_m);
}

std::string rate_text(int rate_hz) {
  return std::string("1/").append(std::to_string(rate_hz));
}

struct Look {
  Cell cell;
  const char* label;
  int style;
  Mark mark;
  const char* fill;
};
constexpr std::array<Look, 3> looks{{{Cell::stable, "stable", 1, Mark::points, "#d6e8f5"},
                                     {Cell::damped, "damped too much", 0, Mark::circles, "#fdf0c0"},
                                     {Cell::unstable, "unstable", 2, Mark::crosses, "#f3c3a8"}}};

std::ptrdiff_t count(const Map& map, Cell cell) {
  std::ptrdiff_t sum = 0;
  for (const std::vector<Cell>& row : map) sum += std::ranges::count(row, cell);
  return sum;
}

std::string caption(Integrator integrator, const Map& map) {
  return title_of(integrator)
      .append(": ")
      .append(std::to_string(count(map, Cell::stable)))
      .append(" cells stable, ")
      .append(std::to_string(count(map, Cell::damped)))
      .append(" damped too much, ")
      .append(std::to_string(count(map, Cell::unstable)))
      .append(" unstable.");
}

void draw(Context& context, const LinearBall& ball, const Grid& grid, Integrator integrator, const Map& map) {
  Plot plot;
  plot.title = title_of(integrator);
  const double wide = std::sqrt(grid.stiffnesses_n_m[1] / grid.stiffnesses_n_m[0]);
  const double high = std::sqrt(static_cast<double>(grid.rates_hz[1]) / grid.rates_hz[0]);
  plot.x = {.label = "stiffness k (N/m)",
            .log = true,
            .range = {grid.stiffnesses_n_m.front() / wide, grid.stiffnesses_n_m.back() * wide}};
  plot.y = {
      .label = "step (s)", .log = true, .range = {1.0 / grid.rates_hz.back() / high, high / grid.rates_hz.front()}};
  std::ostringstream ticks;
  ticks << "set ytics scale 0 (";
  for (std::size_t rate = 0; rate < grid.rates_hz.size(); ++rate) {
    ticks << (rate == 0 ? "" : ", ") << '"' << rate_text(grid.rates_hz[rate]) << "\" " << 1.0 / grid.rates_hz[rate];
  }
  ticks << ")";
  plot.commands = {"unset grid", ticks.str()};
  for (const Look& look : looks) {
    Series series{.label = look.label, .style = look.style, .points = {}, .mark = look.mark};
    for (std::size_t s = 0; s < map.size(); ++s) {
      for (std::size_t r = 0; r < map[s].size(); ++r) {
        if (map[s][r] != look.cell) continue;
        const double k = grid.stiffnesses_n_m[s];
        const double step_s = 1.0 / grid.rates_hz[r];
        series.points.emplace_back(k, step_s);
        std::ostringstream box;
        box << "set object rectangle from " << k / wide << ',' << step_s / high << " to " << k * wide << ','
            << step_s * high << " behind fc rgb '" << look.fill << "' fs solid border rgb '#ffffff'";
        plot.commands.push_back(box.str());
      }
    }
    if (!series.points.empty()) plot.series.push_back(std::move(series));
  }
  const bool is_explicit = physics::is_explicit(integrator);
  Series limit{.label = is_explicit ? "stability limit, theory" : "half the amplitude lost, theory",
               .style = 0,
               .points = {},
               .mark = is_explicit ? Mark::line : Mark::dashed};
  for (const double k : grid.stiffnesses_n_m) {
    const double step_s = limit_s(ball, integrator, k);
    if (step_s > 0.0) limit.points.emplace_back(k, step_s);
  }
  if (!limit.points.empty()) plot.series.push_back(std::move(limit));
  const std::string name(physics::name_of(integrator));
  context.figure(std::string("stability-").append(name), plot, caption(integrator, map));
}

/// Cells on the side of the theory's limit that they should be on, of all.
std::string agreement(const LinearBall& ball, const Grid& grid, Integrator integrator, const Map& map) {
  int agree = 0;
  int all = 0;
  for (std::size_t s = 0; s < map.size(); ++s) {
    const double step_max_s = limit_s(ball, integrator, grid.stiffnesses_n_m[s]);
    if (step_max_s == 0.0) return "-";
    for (std::size_t r = 0; r < map[s].size(); ++r, ++all) {
      const bool below = physics::is_explicit(integrator) ? map[s][r] != Cell::unstable : map[s][r] == Cell::stable;
      if (below == (1.0 / grid.rates_hz[r] <= step_max_s)) ++agree;
    }
  }
  return std::to_string(agree).append(" of ").append(std::to_string(all));
}

/// The longest step that is stable, as are all shorter ones.
std::string longest_stable(const Grid& grid, const std::vector<Cell>& cells) {
  std::string step = "-";
  for (std::size_t r = cells.size(); r-- > 0 && cells[r] == Cell::stable;) step = rate_text(grid.rates_hz[r]);
  return step;
}

/// A stable cell with an unstable or damped one at a shorter step.
bool has_island(const std::vector<Cell>& cells) {
  const auto first = std::ranges::find(cells, Cell::stable);  // the longest step
  return std::any_of(first, cells.end(), [](Cell cell) { return cell != Cell::stable; });
}

void write_xpbd(Page& page, const Map& map) {
  if (const std::ptrdiff_t growing = count(map, Cell::unstable); growing > 0) {
    page.paragraph(
        std::string("XPBD is thought to be stable at any step. Undamped it is not: it grows in ")
            .append(std::to_string(growing))
            .append(" cells, where its one pass over stiff springs, in a fixed order, feeds motion from step "
                    "to step."));
  }
  if (std::ranges::any_of(map, has_island)) {
    page.paragraph(
        "Do not read XPBD's map as the others': where it is stable at long steps on stiff springs, but not at shorter "
        "ones, the springs are softer than they should be. One pass does not reach across the ball.");
  }
}

void run_stability_map(Context& context) {
  context.page.heading("Stability map");
  context.page.paragraph(
      "A ball of 162 vertices and 1 kg, undamped, with gas of 100 Pa in air of 100 Pa, is displaced by some "
      "micrometres "
      "and left for a second, with springs of k = 1 to 10^8 N/m and steps of 1/30 to 1/7,680 s. A cross: its motion "
      "grows "
      "e-fold in a second or faster. A ring: its breathing loses half of its amplitude or more within three periods, "
      "where "
      "the exact motion loses nothing; nothing runs away, but fast motion is not seen. A filled square: neither. The "
      "explicit integrators are displaced along their fastest motion, the others in every motion at once.");
  context.page.paragraph(
      "For your scene: find your stiffness and go up from the shortest step as long as there are filled squares. The "
      "longest step shrinks as 1/sqrt(k) for symplectic Euler and RK4, and faster for midpoint and explicit Euler. "
      "Implicit Euler and TR-BDF2 take any step, and pay with damping. For a ball of mass m in kg and n vertices, read "
      "the map at the stiffness k / m * n / 162.");
  const LinearBall ball;
  const Grid grid = grid_of(context.quick);
  std::vector<std::string> columns{"k (N/m)"};
  std::vector<std::vector<std::string>> rows;
  for (const double k : grid.stiffnesses_n_m) rows.push_back({std::string("10^").append(number(std::log10(k)))});
  std::vector<std::string> agreements{"cells as theory says"};
  std::vector<std::string> unstable{"unstable cells"};
  std::vector<Map> maps;
  for (const Integrator integrator : every_integrator) {
    const Map& map = maps.emplace_back(map_of(ball, grid, integrator, context.workers));
    columns.push_back(title_of(integrator));
    agreements.push_back(agreement(ball, grid, integrator, map));
    unstable.push_back(std::to_string(count(map, Cell::unstable)));
    for (std::size_t s = 0; s < map.size(); ++s) {
      rows[s].push_back(longest_stable(grid, map[s]));
      std::string cells;
      for (const Cell cell : map[s]) cells += static_cast<char>(cell);
      context.outcomes.push_back(
          {std::string("stability ").append(physics::name_of(integrator)).append(" k=").append(rows[s][0]), cells});
    }
    context.progress.advance((1.0 - limits_share) * static_cast<double>(maps.size()) /
                             static_cast<double>(every_integrator.size()));
  }
  rows.push_back(unstable);
  rows.push_back(agreements);
  context.page.subheading("The longest step that is stable and not damped too much (s)");
  context.page.table(columns, rows);
  context.page.paragraph("A dash: none of the steps tried, or no theory.");
  write_xpbd(context.page, maps[xpbd_column]);
  for (std::size_t i = 0; i < maps.size(); ++i) draw(context, ball, grid, every_integrator[i], maps[i]);
  add_stability_limits(context, ball, 1.0 - limits_share, 1.0);
}

}  // namespace

Part stability_map() {
  return {
      .name = "stability-map", .title = "Stability map", .quick_s = 12.0, .full_s = 100.0, .run = run_stability_map};
}

}  // namespace pneuma::report
