#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "numerics/report/part.h"
#include "numerics/report/volume_words.h"

namespace pneuma::report {
namespace {

using physics::Volume;
using physics::VolumeMethod;
using volumes::Cost;
using volumes::cost_of;
using volumes::Moved;
using volumes::moved_by;
using volumes::signed_share;
using volumes::Subject;
using volumes::title_of;

constexpr double round_off = 1e-12;

/// "1e-3" of what lies from there up to 1e-2, either way.
std::string decade_of(double error) {
  if (!std::isfinite(error)) return "failed";
  if (std::abs(error) < round_off) return "round-off";
  return std::string("1e").append(number(std::floor(std::log10(std::abs(error)))));
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
                       .append(", turned sixty ways. Numbers are of cells along an edge of the box, or of samples; "
                               "from mark to mark twice the cells, four times the samples. "
                               "`EXACT` is off by round-off, ")
                       .append(number(exact.error_rms, 1))
                       .append(", below the scale; the dashed line is at its time, ")
                       .append(volumes::microseconds(exact.time_us))
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
                  "between the first and the last eighth of a second, over its greatest kinetic energy."));
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

void run_volume_methods(Context& context) {
  context.page.heading("Volume methods");
  context.page.paragraph(
      "Six ways to find the volume that the gas fills (`volume.method`): exactly, by the faces; by a bounding box, "
      "ball "
      "or ellipsoid, as the paper does; and by the paper's two future works, the bounding box cut into cells "
      "(`SUBDIVIDED`) or sampled at points (`MONTE_CARLO`), finer with a greater `volume.resolution` (16 and 4,096 "
      "where none is given).");
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
  volumes::write_advice(context.page, subjects, moved);
}

}  // namespace

Part volume_methods() {
  return {
      .name = "volume-methods", .title = "Volume methods", .quick_s = 6.0, .full_s = 9.0, .run = run_volume_methods};
}

}  // namespace pneuma::report
