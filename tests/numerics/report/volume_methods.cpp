#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "numerics/report/part.h"
#include "numerics/report/volume_costs.h"
#include "numerics/report/volume_motion.h"

namespace pneuma::report {
namespace {

using physics::Volume;
using physics::VolumeMethod;
using volumes::Cost;
using volumes::cost_of;
using volumes::title_of;

constexpr double round_off = 1e-12;

struct Subject {
  std::string name;
  std::string title;
  std::vector<Cost> costs;
};

// What bodies are moved by, EXACT first. Finer samples would show nothing but their time.
const std::vector<Volume>& moved_by() {
  static const std::vector<Volume> all{{VolumeMethod::exact},
                                       {VolumeMethod::box},
                                       {VolumeMethod::ball},
                                       {VolumeMethod::ellipsoid},
                                       {VolumeMethod::subdivided, 4},
                                       {VolumeMethod::subdivided, 16},
                                       {VolumeMethod::subdivided, 64},
                                       {VolumeMethod::monte_carlo, 256},
                                       {VolumeMethod::monte_carlo, 4096}};
  return all;
}

struct Moved {
  volumes::Motion motion;
  std::vector<volumes::MotionResult> results;  // of moved_by()

  [[nodiscard]] const volumes::MotionResult& exact() const { return results.front(); }
  [[nodiscard]] double rest_error(std::size_t i) const {
    return results[i].volume_at_rest_m3 / exact().volume_at_rest_m3 - 1.0;
  }
  [[nodiscard]] double period_error(std::size_t i) const { return results[i].period_s / exact().period_s - 1.0; }
  /// Of the greatest kinetic energy.
  [[nodiscard]] double energy_gain(std::size_t i) const { return results[i].energy_gained_j / exact().kinetic_max_j; }
};

/// "1e-3" of what lies from there up to 1e-2, either way.
std::string decade_of(double error) {
  if (!std::isfinite(error)) return "failed";
  if (std::abs(error) < round_off) return "round-off";
  return std::string("1e").append(number(std::floor(std::log10(std::abs(error)))));
}

/// To two digits, and all of those before the point.
std::string rounded(double value) {
  return std::abs(value) < 99.5 ? number(value, 2) : fixed(value, 0);
}

std::string microseconds(double time_us) {
  return rounded(time_us).append(" \u00b5s");
}

std::string times(double ratio) {
  return rounded(ratio).append(" times");
}

std::string share(double ratio) {
  return rounded(100.0 * ratio).append(" %");
}

/// "+3 %".
std::string signed_share(double ratio) {
  return std::string(ratio > 0.0 ? "+" : "").append(share(ratio));
}

int style_of(VolumeMethod method) {
  switch (method) {
    case VolumeMethod::exact:
      return 0;
    case VolumeMethod::subdivided:
      return 1;
    case VolumeMethod::monte_carlo:
      return 2;
    case VolumeMethod::box:
      return 3;
    case VolumeMethod::ball:
      return 4;
    case VolumeMethod::ellipsoid:
      return 5;
  }
  return 0;
}

// Beside the point: of the cells below it, of the samples above, where the other ladder is not.
std::string resolution_label(const Cost& cost) {
  const bool cells = cost.volume.method == VolumeMethod::subdivided;
  return std::string("set label '")
      .append(std::to_string(cost.volume.resolution))
      .append("' at ")
      .append(number(cost.time_us, 6))
      .append(",")
      .append(number(cost.error_rms, 6))
      .append(cells ? " right offset -0.8,-0.5" : " left offset 0.8,0.5")
      .append(" front tc rgb '")
      .append(colour(style_of(cost.volume.method)))
      .append("'");
}

Plot plot_of(const Subject& subject) {
  Plot plot;
  plot.title = std::string("Volume of ").append(subject.title);
  plot.x = {.label = "CPU time of one volume (\u00b5s)", .log = true, .range = {0.05, 5000.0}};
  plot.commands = {"set key noenhanced"};  // no subscripts in names
  double least = 1.0;
  double most = 0.0;
  for (const Cost& cost : subject.costs) {
    most = std::max(most, cost.error_rms);
    if (cost.error_rms > round_off) least = std::min(least, cost.error_rms);
  }
  plot.y = {
      .label = "RMS error / exact volume",
      .log = true,
      .range = {std::pow(10.0, std::floor(std::log10(least))), std::pow(10.0, std::ceil(std::log10(2.0 * most)))}};
  for (const physics::VolumeLadder& ladder : physics::volume_ladders()) {
    Series series{.label = std::string(ladder.name), .style = style_of(ladder.method), .points = {}};
    if (ladder.resolutions.size() == 1) series.mark = Mark::points;
    bool labelled = true;  // every other one, or long numbers overlap
    for (const std::uint32_t resolution : ladder.resolutions) {
      const Cost& cost = cost_of(subject.costs, {ladder.method, resolution});
      series.points.emplace_back(cost.time_us, cost.error_rms);
      if (resolution != 0 && labelled) plot.commands.push_back(resolution_label(cost));
      labelled = !labelled;
    }
    if (ladder.method == VolumeMethod::exact) {
      const double time_us = series.points.front().first;
      series.points = {{time_us, plot.y.range.first}, {time_us, plot.y.range.second}};
      series.mark = Mark::dashed;
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

void write_costs(Context& context, const std::array<Subject, 2>& subjects) {
  context.page.subheading("What a volume costs");
  Csv csv = context.csv("volume-methods", {"mesh", "method", "resolution", "error_rms", "time_us"});
  for (const Subject& subject : subjects) {
    for (const Cost& cost : subject.costs) {
      csv.row({subject.name, volumes::name_of(cost.volume), static_cast<double>(cost.volume.resolution), cost.error_rms,
               cost.time_us});
      context.outcomes.push_back(
          {std::string("volume ").append(subject.name).append(" ").append(volumes::plain_title_of(cost.volume)),
           decade_of(cost.error_rms)});
    }
    const Cost& exact = subject.costs.front();
    context.figure(std::string("volume-").append(subject.name), plot_of(subject),
                   std::string("Error over time on ")
                       .append(subject.title)
                       .append(", turned sixty ways. Numbers are of cells along an edge of the box, or of samples. "
                               "`EXACT` is off by round-off, ")
                       .append(number(exact.error_rms, 1))
                       .append(", below the scale; the dashed line is at its time, ")
                       .append(microseconds(exact.time_us))
                       .append("."));
  }
}

void write_motions(Context& context, const std::array<Moved, 2>& moved) {
  const auto& [ball, hand] = moved;
  context.page.subheading("What its error does to the motion");
  context.page.paragraph(
      std::string("The gas presses as the measured volume says. Two bodies by each method, against the same body by "
                  "`EXACT`: a ball of 162 vertices that breathes and slowly turns (at rest ")
          .append(number(ball.exact().volume_at_rest_m3))
          .append(" m\u00b3, period ")
          .append(number(ball.exact().period_s))
          .append(" s), and the hand without its pins, tumbling at a turn in 0.9 s (at rest ")
          .append(number(1e6 * hand.exact().volume_at_rest_m3))
          .append(" cm\u00b3). The volume at rest is the true one of the shape that the body takes, damped; period and "
                  "energy are undamped, over 0.5 s by symplectic Euler. Energy is what the motion gained from nowhere "
                  "between the "
                  "first and the last eighth of a second, over its greatest kinetic energy."));
  Csv csv = context.csv("volume-motion", {"body", "method", "resolution", "volume_at_rest_m3", "period_s",
                                          "energy_gained_j", "kinetic_max_j"});
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < moved_by().size(); ++i) {
    const Volume& volume = moved_by()[i];
    rows.push_back({title_of(volume), signed_share(ball.rest_error(i)), signed_share(ball.period_error(i)),
                    signed_share(ball.energy_gain(i)), signed_share(hand.rest_error(i)),
                    signed_share(hand.energy_gain(i))});
    for (const Moved& each : moved) {
      const volumes::MotionResult& result = each.results[i];
      csv.row({each.motion.name, volumes::name_of(volume), static_cast<double>(volume.resolution),
               result.volume_at_rest_m3, result.period_s, result.energy_gained_j, result.kinetic_max_j});
      const auto outcome = [&](const std::string& of, double error) {
        context.outcomes.push_back({std::string("volume-motion ")
                                        .append(each.motion.name)
                                        .append(" ")
                                        .append(volumes::plain_title_of(volume))
                                        .append(" ")
                                        .append(of),
                                    decade_of(error)});
      };
      if (i != 0) outcome("rest", each.rest_error(i));
      if (i != 0 && each.motion.period_s > 0.0) outcome("period", each.period_error(i));
      outcome("energy", each.energy_gain(i));
    }
  }
  context.page.table(
      {"`volume.method`, resolution", "ball: volume at rest", "period", "energy", "hand: volume at rest", "energy"},
      rows);
}

/// The cheapest rung of the method that is within `error` on each subject; null where none is.
const Cost* cheapest_within(double error, VolumeMethod method, const std::array<Subject, 2>& subjects) {
  for (std::size_t i = 0; i < subjects[0].costs.size(); ++i) {  // from coarse to fine
    if (subjects[0].costs[i].volume.method != method) continue;
    if (std::ranges::all_of(subjects, [&](const Subject& each) { return each.costs[i].error_rms <= error; })) {
      return &subjects[0].costs[i];
    }
  }
  return nullptr;
}

/// By how much the time grows for a tenth of the error, from the method's first rung to its last.
double time_ratio_for_a_tenth(const std::vector<Cost>& costs, VolumeMethod method) {
  const Cost* first = nullptr;
  const Cost* last = nullptr;
  for (const Cost& cost : costs) {
    if (cost.volume.method != method) continue;
    if (first == nullptr) first = &cost;
    last = &cost;
  }
  return std::pow(last->time_us / first->time_us, 1.0 / std::log10(first->error_rms / last->error_rms));
}

/// "x on the ball and y on the hand".
template <class Words>
std::string on_both(const std::array<Subject, 2>& subjects, const Words& words) {
  return words(subjects[0].costs).append(" on the ball and ").append(words(subjects[1].costs)).append(" on the hand");
}

std::string within_one_percent(VolumeMethod method, const std::array<Subject, 2>& subjects) {
  const Cost* cheapest = cheapest_within(0.01, method, subjects);
  if (cheapest == nullptr) return "no resolution here of " + title_of({method});
  return title_of(cheapest->volume)
      .append(" (")
      .append(on_both(
          subjects,
          [&](const std::vector<Cost>& costs) { return microseconds(cost_of(costs, cheapest->volume).time_us); }))
      .append(")");
}

void write_advice(Page& page, const std::array<Subject, 2>& subjects, const std::array<Moved, 2>& moved) {
  const auto time = [&](const Volume& volume) {
    return on_both(subjects,
                   [&](const std::vector<Cost>& costs) { return microseconds(cost_of(costs, volume).time_us); });
  };
  const auto error = [&](const Volume& volume) {
    return on_both(subjects, [&](const std::vector<Cost>& costs) { return share(cost_of(costs, volume).error_rms); });
  };
  const auto slower = [&](const Volume& volume) {
    return on_both(subjects, [&](const std::vector<Cost>& costs) {
      return times(cost_of(costs, volume).time_us / costs.front().time_us).append(" as long");
    });
  };
  const Volume exact{VolumeMethod::exact};
  const Volume ellipsoid{VolumeMethod::ellipsoid};
  const Volume coarsest{VolumeMethod::subdivided, 4};
  page.subheading("Which one to use");
  page.bullet(std::string("**`EXACT`**, the default: ")
                  .append(time(exact))
                  .append(", and no error. The cheapest sampling here, ")
                  .append(title_of(coarsest))
                  .append(", takes ")
                  .append(slower(coarsest))
                  .append(", and is off by ")
                  .append(error(coarsest))
                  .append("."));
  page.bullet(std::string("**`ELLIPSOID`** takes ")
                  .append(time(ellipsoid))
                  .append(", ")
                  .append(slower(ellipsoid))
                  .append(", and is off by ")
                  .append(error(ellipsoid))
                  .append(": for what stays round. `BALL` is off by ")
                  .append(error({VolumeMethod::ball}))
                  .append(", `BOX` by ")
                  .append(error({VolumeMethod::box}))
                  .append("."));
  page.bullet(std::string("Of the two that sample, within 1 % on both meshes first: ")
                  .append(within_one_percent(VolumeMethod::subdivided, subjects))
                  .append(", ")
                  .append(within_one_percent(VolumeMethod::monte_carlo, subjects))
                  .append(". On the ball a tenth of the error takes ")
                  .append(times(time_ratio_for_a_tenth(subjects[0].costs, VolumeMethod::subdivided)))
                  .append(" the time by `SUBDIVIDED`, and ")
                  .append(times(time_ratio_for_a_tenth(subjects[0].costs, VolumeMethod::monte_carlo)))
                  .append(" by `MONTE_CARLO`."));
  const Moved& ball = moved[0];
  const Moved* worst_of = &ball;
  std::size_t worst = 0;
  for (const Moved& each : moved) {
    for (std::size_t i = 1; i < moved_by().size(); ++i) {
      if (!(std::abs(each.energy_gain(i)) > std::abs(worst_of->energy_gain(worst)))) continue;
      worst_of = &each;
      worst = i;
    }
  }
  const std::size_t box = 1;
  page.bullet(
      std::string("In motion, a volume that is off by the same ratio all along acts as another amount of gas: by "
                  "`BOX` the ball comes to rest at a volume that is ")
          .append(signed_share(ball.rest_error(box)))
          .append(" off, and breathes at a period that is ")
          .append(signed_share(ball.period_error(box)))
          .append(" off. A ratio that changes as a body turns or bends makes energy or takes it besides: at most ")
          .append(signed_share(worst_of->energy_gain(worst)))
          .append(" here, of the ")
          .append(worst_of->motion.name)
          .append(" by ")
          .append(title_of(moved_by()[worst]))
          .append(", where `EXACT` comes to ")
          .append(signed_share(worst_of->energy_gain(0)))
          .append("."));
}

void run(Context& context) {
  context.page.heading("Volume methods");
  context.page.paragraph(
      "Six ways to find the volume that the gas fills (`volume.method`): exactly, by the faces; by a bounding box, "
      "ball "
      "or ellipsoid, as the paper does; and by the paper's two future works, the bounding box cut into cells "
      "(`SUBDIVIDED`) or sampled at points (`MONTE_CARLO`), finer with a greater `volume.resolution`.");
  const int rounds = context.quick ? 3 : 15;
  std::array<Subject, 2> subjects{{{"ball", "a ball of 162 vertices", {}}, {"hand", "the hand of 1,159 vertices", {}}}};
  subjects[0].costs = volumes::costs_of(physics::ball_measured_by({}), rounds);
  context.progress.advance(0.15);
  subjects[1].costs = volumes::costs_of(physics::hand_measured_by({}), rounds);
  context.progress.advance(0.4);
  write_costs(context, subjects);

  std::array<volumes::Motion, 2> motions = volumes::motions();
  std::array<Moved, 2> moved;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    moved[i].motion = std::move(motions[i]);
    moved[i].results.resize(moved_by().size());
    context.workers.for_each(moved_by().size(), [&each = moved[i]](std::size_t method) {
      each.results[method] = volumes::run_motion(each.motion, moved_by()[method]);
    });
    context.progress.advance(i == 0 ? 0.6 : 1.0);
  }
  write_motions(context, moved);
  write_advice(context.page, subjects, moved);
}

}  // namespace

Part volume_methods() {
  return {.name = "volume-methods", .title = "Volume methods", .quick_s = 6.0, .full_s = 12.0, .run = run};
}

}  // namespace pneuma::report
