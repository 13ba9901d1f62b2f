#include "numerics/report/volume_costs.h"

#include <algorithm>
#include <functional>

#include "numerics/report/timing.h"

namespace pneuma::report::volumes {

using physics::Volume;

namespace {

// All poses, so often that the clock is fine enough for the methods that take a fraction of a microsecond each.
int repeats_of(const Volume& volume) {
  return volume.resolution == 0 ? 30 : 1;
}

}  // namespace

std::string name_of(const Volume& volume) {
  return std::string(std::ranges::find(physics::volume_ladders(), volume.method, &physics::VolumeLadder::method)->name);
}

std::string plain_title_of(const Volume& volume) {
  std::string title = name_of(volume);
  if (volume.resolution != 0) title.append(" ").append(std::to_string(volume.resolution));
  return title;
}

std::string title_of(const Volume& volume) {
  std::string title = std::string("`").append(name_of(volume)).append("`");
  if (volume.resolution != 0) title.append(", ").append(std::to_string(volume.resolution));
  return title;
}

std::vector<Cost> costs_of(physics::SoftBody body, int rounds) {
  const std::vector<std::vector<physics::Vec3d>> poses_m = physics::turned_m(*body.mesh);
  std::vector<Cost> costs;
  std::vector<std::function<void()>> contenders;
  double sum_m3 = 0.0;
  for (const physics::VolumeLadder& ladder : physics::volume_ladders()) {
    for (const std::uint32_t resolution : ladder.resolutions) {
      body.volume = {ladder.method, resolution};
      costs.push_back({body.volume, physics::volume_error(body, poses_m).rms});
      contenders.emplace_back([&sum_m3, &poses_m, body] {
        for (int i = 0; i < repeats_of(body.volume); ++i) {
          for (const auto& x : poses_m) sum_m3 += physics::body_volume_m3<double>(body, x);
        }
      });
    }
  }
  const std::vector<double> times_s = race_s(contenders, rounds);
  for (std::size_t i = 0; i < costs.size(); ++i) {
    costs[i].time_us = 1e6 * times_s[i] / (static_cast<double>(poses_m.size()) * repeats_of(costs[i].volume));
  }
  return costs;
}

const Cost& cost_of(const std::vector<Cost>& costs, const Volume& volume) {
  return *std::ranges::find(costs, volume, &Cost::volume);
}

}  // namespace pneuma::report::volumes
