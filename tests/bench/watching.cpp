#include "bench/watching.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <thread>

#include <unistd.h>

#include "bench/crowd.h"
#include "pneuma_client/client.h"
#include "support/server_process.h"

namespace pneuma::bench {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::duration;
using std::chrono::milliseconds;
using std::chrono::seconds;

// A crowd on one core, the server on another.
constexpr std::size_t server_core = 0;
constexpr std::size_t crowd_core = 1;
constexpr double crowd_rate_hz = 30.0;
constexpr seconds crowd_settles{2};
constexpr double world_rate_hz = 60.0;
constexpr double watched_within_m = 1e-3;

std::string file_of(pid_t pid, const char* name) {
  return std::string("/proc/").append(std::to_string(pid)).append("/").append(name);
}

}  // namespace

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto rank = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(rank));
  return values[rank];
}

double count_within(const std::vector<double>& values, double bound) {
  return static_cast<double>(std::ranges::count_if(values, [&](double value) { return value <= bound; }));
}

double share_within(const std::vector<double>& values, double bound) {
  return count_within(values, bound) / static_cast<double>(values.size());
}

double resident_mib(pid_t pid) {
  std::ifstream statm(file_of(pid, "statm"));
  double total_pages = 0.0;
  double resident_pages = 0.0;
  statm >> total_pages >> resident_pages;
  return resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

double processor_s(pid_t pid) {
  std::ifstream stat(file_of(pid, "stat"));
  std::string word;
  // The second is the program's name in brackets; the 14th and 15th are times in user and system mode.
  stat.ignore(std::numeric_limits<std::streamsize>::max(), ')');
  for (int i = 0; i < 11; ++i) stat >> word;
  double user = 0.0;
  double system = 0.0;
  stat >> user >> system;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

base::Result<CrowdRun> watch_five_balls(std::size_t prompt, bool slow, seconds watched) {
  const std::string connections = std::to_string(prompt + 8);
  base::Result<support::ServerProcess> server = [&] {
    const OnCore core(server_core);
    return support::ServerProcess::start(
        {"--connections-max", connections, "--connections-per-address-max", connections, "--log-level", "warn"});
  }();
  if (!server.ok()) return server.status();
  const OnCore core(crowd_core);
  auto control = client::Client::connect(server->tcp_address());
  if (!control.ok()) return control.status();
  if (auto done = control->create_builtin("five-balls", "w", true); !done.ok()) return done.status();
  if (auto stream = control->subscribe("w", {.rate_hz = crowd_rate_hz}); !stream.ok()) return stream.status();
  Crowd crowd(server->tcp_address());
  const Crowd::Watched watching{.world = "w", .rate_hz = crowd_rate_hz};
  if (auto joined = crowd.add(Crowd::Pace::prompt, prompt, watching); !joined.ok()) return joined;
  if (slow) {
    if (auto joined = crowd.add(Crowd::Pace::byte_a_second, 1, watching); !joined.ok()) return joined;
    if (auto joined = crowd.add(Crowd::Pace::stuck, 1, watching); !joined.ok()) return joined;
  }
  const auto resumed = Clock::now();  // tick 1 is due when the server takes the request: after this
  if (auto done = control->resume("w"); !done.ok()) return done.status();
  std::vector<double> encode_us;
  base::Result<v1::Stats> stats = v1::Stats();
  while (Clock::now() < resumed + crowd_settles + watched) {
    std::this_thread::sleep_for(milliseconds(97));
    stats = control->stats("w");
    if (!stats.ok()) return stats.status();
    for (const v1::Stats::Stream& stream : stats->streams()) encode_us.push_back(stream.encode_time_us());
  }
  auto arrivals = crowd.leave();
  if (!arrivals.ok()) return arrivals.status();

  CrowdRun run;
  run.encode_us = percentile(encode_us, 0.5);
  run.tick_late_ms = stats->due_error_ms_p99();
  run.slipped_s = stats->slipped_s();
  const duration<double, std::milli> period(1e3 / stats->rate_hz());
  for (const Crowd::Arrival& arrival : *arrivals) {
    const duration<double, std::milli> due = static_cast<double>(arrival.tick - 1) * period;
    if (arrival.tick > 0 && due > crowd_settles)
      run.ages_ms.push_back(duration<double, std::milli>(arrival.at - resumed - due).count());
  }
  return run;
}

base::Result<std::vector<double>> watch_worlds_late_ms(std::size_t worlds, seconds watched) {
  auto server = support::ServerProcess::start({"--log-level", "warn", "--connections-max", std::to_string(worlds + 8),
                                               "--connections-per-address-max", std::to_string(worlds + 8)});
  if (!server.ok()) return server.status();
  auto control = client::Client::connect(server->tcp_address());
  if (!control.ok()) return control.status();
  Crowd crowd(server->tcp_address());
  for (std::size_t i = 0; i < worlds; ++i) {
    const std::string name = std::string("w").append(std::to_string(i));
    if (auto done = control->create_builtin("five-balls", name); !done.ok()) return done.status();
    const Crowd::Watched watching{.world = name, .max_error_m = watched_within_m};
    if (auto joined = crowd.add(Crowd::Pace::prompt, 1, watching); !joined.ok()) return joined;
  }
  const auto from = Clock::now() + crowd_settles;
  while (Clock::now() < from + watched) {
    std::this_thread::sleep_for(seconds(1));
    if (auto alive = control->ping(); !alive.ok()) return alive.status();
  }
  auto arrivals = crowd.leave();
  if (!arrivals.ok()) return arrivals.status();
  std::erase_if(*arrivals, [&](const Crowd::Arrival& arrival) { return arrival.at < from; });
  const auto after_due_ms = [](const Crowd::Arrival& arrival) {
    const duration<double, std::milli> at = arrival.at.time_since_epoch();
    return at.count() - 1e3 / world_rate_hz * static_cast<double>(arrival.tick);
  };
  std::vector<double> promptest_ms(worlds, std::numeric_limits<double>::infinity());
  for (const Crowd::Arrival& arrival : *arrivals) {
    promptest_ms[arrival.group] = std::min(promptest_ms[arrival.group], after_due_ms(arrival));
  }
  std::vector<double> late_ms;
  for (const Crowd::Arrival& arrival : *arrivals)
    late_ms.push_back(after_due_ms(arrival) - promptest_ms[arrival.group]);
  return late_ms;
}

}  // namespace pneuma::bench
