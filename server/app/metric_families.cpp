#include "app/metric_families.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>

#include <sys/resource.h>
#include <unistd.h>

#include "base/version.h"
#include "physics/lanes/isa.h"

namespace pneuma::app {

namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

#if defined(__clang__)
constexpr const char* compiler = "clang " __clang_version__;
#else
constexpr const char* compiler = "g++ " __VERSION__;
#endif

MetricFamily family(const char* name, const char* help, MetricType type) {
  MetricFamily made;
  made.name = name;
  made.help = help;
  made.type = type;
  return made;
}

void add(MetricFamily& to, double value, std::vector<ClientMetric::Label> labels = {}) {
  ClientMetric& metric = to.metric.emplace_back();
  metric.label = std::move(labels);
  if (to.type == MetricType::Counter) {
    metric.counter.value = value;
  } else {
    metric.gauge.value = value;
  }
}

MetricFamily single(const char* name, const char* help, MetricType type, double value) {
  MetricFamily made = family(name, help, type);
  add(made, value);
  return made;
}

double checkpoint_age_s(const WorldStatus& world, std::chrono::steady_clock::time_point now) {
  if (!world.behind_checkpoint_of) return 0.0;
  return std::max(0.0, std::chrono::duration<double>(now - *world.behind_checkpoint_of).count());
}

/// Fields of /proc/self/stat from the third on, which follow the program's name in brackets.
std::vector<double> read_process_stat() {
  std::ifstream file("/proc/self/stat");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 1)));
  std::string state;
  fields >> state;
  std::vector<double> numbers{0.0};
  for (double number = 0.0; fields >> number;) numbers.push_back(number);
  return numbers;
}

double boot_time_s() {
  std::ifstream file("/proc/stat");
  for (std::string key; file >> key; file.ignore(1 << 16, '\n')) {
    double value = 0.0;
    if (key == "btime" && file >> value) return value;
  }
  return 0.0;
}

}  // namespace

std::vector<MetricFamily> world_families(const std::vector<WorldStatus>& worlds,
                                         std::chrono::steady_clock::time_point now, const MayName& may_name) {
  MetricFamily lateness =
      family("pneuma_world_lateness_seconds", "How late a world's ticks end, 99th percentile of its last five seconds.",
             MetricType::Gauge);
  MetricFamily ratio =
      family("pneuma_world_time_ratio", "Simulated over real time in a world's last second; 1 where it keeps up.",
             MetricType::Gauge);
  MetricFamily age = family("pneuma_world_checkpoint_age_seconds",
                            "Age of a world's last checkpoint; 0 where it has all of the world.", MetricType::Gauge);
  double latest_s = 0.0;
  double slowest = 1.0;
  double oldest_s = 0.0;
  std::size_t labelled = 0;
  for (const WorldStatus& world : worlds) {
    if (world.listing.damaged() || world.listing.restoring()) continue;
    const double age_s = checkpoint_age_s(world, now);
    latest_s = std::max(latest_s, world.lateness_s);
    slowest = std::min(slowest, world.time_ratio);
    oldest_s = std::max(oldest_s, age_s);
    if (!may_name(world.listing.name()) || ++labelled > labelled_worlds_max) continue;
    const std::vector<ClientMetric::Label> label{{"world", world.listing.name()}};
    add(lateness, world.lateness_s, label);
    add(ratio, world.time_ratio, label);
    add(age, age_s, label);
  }
  std::vector<MetricFamily> families;
  families.push_back(single("pneuma_latest_world_lateness_seconds",
                            "The largest pneuma_world_lateness_seconds of all worlds.", MetricType::Gauge, latest_s));
  families.push_back(single("pneuma_slowest_world_time_ratio", "The least pneuma_world_time_ratio of all worlds.",
                            MetricType::Gauge, slowest));
  families.push_back(single("pneuma_oldest_checkpoint_age_seconds",
                            "The largest pneuma_world_checkpoint_age_seconds of all worlds.", MetricType::Gauge,
                            oldest_s));
  for (MetricFamily* each : {&lateness, &ratio, &age}) {
    if (!each->metric.empty()) families.push_back(std::move(*each));
  }
  return families;
}

std::vector<MetricFamily> process_families() {
  std::vector<MetricFamily> families;
  const std::vector<double> stat = read_process_stat();
  // proc(5), counted from the state: 3 is number 0 here.
  constexpr std::size_t user_ticks = 11;
  constexpr std::size_t system_ticks = 12;
  constexpr std::size_t start_ticks = 19;
  constexpr std::size_t virtual_bytes = 20;
  constexpr std::size_t resident_pages = 21;
  if (stat.size() > resident_pages) {
    const auto ticks_per_s = static_cast<double>(sysconf(_SC_CLK_TCK));
    families.push_back(single("process_cpu_seconds_total", "Processor time, of the user and the system.",
                              MetricType::Counter, (stat[user_ticks] + stat[system_ticks]) / ticks_per_s));
    families.push_back(single("process_start_time_seconds", "When the process started, since 1970.", MetricType::Gauge,
                              boot_time_s() + stat[start_ticks] / ticks_per_s));
    families.push_back(
        single("process_virtual_memory_bytes", "Virtual memory.", MetricType::Gauge, stat[virtual_bytes]));
    families.push_back(single("process_resident_memory_bytes", "Resident memory.", MetricType::Gauge,
                              stat[resident_pages] * static_cast<double>(sysconf(_SC_PAGESIZE))));
  }
  std::error_code error;
  const std::filesystem::directory_iterator open_files("/proc/self/fd", error);
  if (!error) {
    families.push_back(single("process_open_fds", "File descriptors that are open.", MetricType::Gauge,
                              static_cast<double>(std::distance(begin(open_files), end(open_files)))));
  }
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
    families.push_back(single("process_max_fds", "File descriptors that may be open.", MetricType::Gauge,
                              static_cast<double>(limit.rlim_cur)));
  }
  return families;
}

MetricFamily build_family() {
  MetricFamily made = family("pneuma_build_info", "What runs: always 1.", MetricType::Gauge);
  const auto isa = static_cast<std::size_t>(physics::isa_in_use());
  add(made, 1.0,
      {{"version", std::string(base::version)},
       {"compiler", compiler},
       {"instruction_set", std::string(physics::isa_names[isa])}});
  return made;
}

}  // namespace pneuma::app
