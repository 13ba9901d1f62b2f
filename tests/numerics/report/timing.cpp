#include "numerics/report/timing.h"

#include <algorithm>
#include <ctime>

namespace pneuma::report {

double cpu_time_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::vector<double> race_s(const std::vector<std::function<void()>>& contenders, int rounds, double once_s,
                           const std::function<void()>& between) {
  const auto timed_s = [&](const std::function<void()>& run) {
    const double begun_s = cpu_time_s();
    run();
    const double took_s = cpu_time_s() - begun_s;
    if (between) between();
    return took_s;
  };
  std::vector<double> warm_up_s;
  for (const auto& contender : contenders) warm_up_s.push_back(timed_s(contender));
  std::vector<std::vector<double>> times_s(contenders.size());
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      if (warm_up_s[i] <= once_s) times_s[i].push_back(timed_s(contenders[i]));
    }
  }
  std::vector<double> medians_s;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (times_s[i].empty()) times_s[i].push_back(warm_up_s[i]);
    const auto middle = times_s[i].begin() + static_cast<std::ptrdiff_t>(times_s[i].size() / 2);
    std::ranges::nth_element(times_s[i], middle);
    medians_s.push_back(*middle);
  }
  return medians_s;
}

}  // namespace pneuma::report
