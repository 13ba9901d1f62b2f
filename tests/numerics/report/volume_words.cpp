#include "numerics/report/volume_words.h"

#include <algorithm>
#include <cmath>

namespace pneuma::report::volumes {

using physics::Volume;
using physics::VolumeMethod;

namespace {

std::string times(double ratio) {
  return number(ratio, 2).append(" times");
}

/// "4.4 % too long", "40 % too short".
std::string too(double ratio, const std::string& more, const std::string& less) {
  return share(std::abs(ratio)).append(" too ").append(ratio < 0.0 ? less : more);
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

}  // namespace

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

std::string microseconds(double time_us) {
  return number(time_us, 2).append(" \u00b5s");
}

std::string share(double ratio) {
  return number(100.0 * ratio, 2).append(" %");
}

std::string signed_share(double ratio) {
  return std::string(ratio > 0.0 ? "+" : "").append(share(ratio));
}

namespace {

void write_motion_advice(Page& page, const std::array<Moved, 2>& moved) {
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
          .append(too(ball.rest_error(box), "large", "small"))
          .append(", and breathes at a period that is ")
          .append(too(ball.period_error(box), "long", "short"))
          .append(". A ratio that changes as a body turns or bends also adds energy or takes it away: at most ")
          .append(signed_share(worst_of->energy_gain(worst)))
          .append(" here, of the ")
          .append(worst_of->motion.name)
          .append(" by ")
          .append(title_of(moved_by()[worst]))
          .append(", where `EXACT` comes to ")
          .append(signed_share(worst_of->energy_gain(0)))
          .append("."));
}

}  // namespace

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
                  .append(" as that, and is off by ")
                  .append(error(coarsest))
                  .append("."));
  page.bullet(std::string("**`ELLIPSOID`** takes ")
                  .append(time(ellipsoid))
                  .append(", which is ")
                  .append(slower(ellipsoid))
                  .append(" as `EXACT`. It is off by ")
                  .append(error(ellipsoid))
                  .append(": take it only for what stays round. `BALL` is off by ")
                  .append(error({VolumeMethod::ball}))
                  .append(", `BOX` by ")
                  .append(error({VolumeMethod::box}))
                  .append("."));
  page.bullet(std::string("Of the two that sample, the coarsest within 1 % on both meshes are ")
                  .append(within_one_percent(VolumeMethod::subdivided, subjects))
                  .append(" and ")
                  .append(within_one_percent(VolumeMethod::monte_carlo, subjects))
                  .append(". On the ball a tenth of the error takes ")
                  .append(times(time_ratio_for_a_tenth(subjects[0].costs, VolumeMethod::subdivided)))
                  .append(" the time by `SUBDIVIDED`, and ")
                  .append(times(time_ratio_for_a_tenth(subjects[0].costs, VolumeMethod::monte_carlo)))
                  .append(" by `MONTE_CARLO`."));
  write_motion_advice(page, moved);
}

}  // namespace pneuma::report::volumes
