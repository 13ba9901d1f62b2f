// Shows that what Prometheus is told keeps to its conventions, that worlds are told of within bounds, and that the
// dashboard and the alert rules of docker/ ask for nothing that is not told.
#include "app/metric_families.h"

#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "app/http_pages.h"
#include "app/metrics.h"

namespace pneuma::app {
namespace {

using std::chrono::seconds;
using MetricTime = std::chrono::steady_clock::time_point;

WorldStatus status_of(const std::string& name, double lateness_s = 0.0, double time_ratio = 1.0) {
  WorldStatus status;
  status.listing.set_name(name);
  status.lateness_s = lateness_s;
  status.time_ratio = time_ratio;
  return status;
}

std::string page_of(
    const std::vector<WorldStatus>& worlds, MetricTime now = {},
    const MayName& may_name = [](std::string_view) { return true; }) {
  Metrics metrics;
  metrics.count_command("step", "ok");
  return *metrics_page(metrics, worlds, now, may_name).body;
}

/// The type of each family on a page.
std::map<std::string, std::string> types_on(const std::string& page) {
  static const std::regex line("# TYPE (\\S+) (\\S+)");
  std::map<std::string, std::string> types;
  for (std::sregex_iterator found(page.begin(), page.end(), line), end; found != end; ++found) {
    EXPECT_TRUE(types.emplace((*found)[1], (*found)[2]).second) << (*found)[1] << " is told twice";
  }
  return types;
}

TEST(MetricFamilies, NamesAndUnitsAreThoseOfPrometheusConventions) {
  const std::string page = page_of({status_of("w")});
  const auto types = types_on(page);
  EXPECT_GE(types.size(), 30U);
  const std::regex name_form("(pneuma|process)(_[a-z0-9]+)+");
  const std::regex no_base_unit(".*_(ms|milliseconds|us|minutes|hours|kb|mb|mib|bits|percent|kilobytes)(_.*)?");
  for (const auto& [name, type] : types) {
    SCOPED_TRACE(name);
    EXPECT_TRUE(std::regex_match(name, name_form));
    EXPECT_FALSE(std::regex_match(name, no_base_unit));
    EXPECT_EQ(name.ends_with("_total"), type == "counter");
    EXPECT_EQ(name.find(type), std::string::npos) << "the type is no part of a name";
    EXPECT_FALSE(name.ends_with("_count") || name.ends_with("_sum") || name.ends_with("_bucket"));
    EXPECT_NE(page.find("# HELP " + name + " "), std::string::npos);
  }
  for (const char* wanted : {"process_cpu_seconds_total", "process_resident_memory_bytes", "process_open_fds",
                             "process_start_time_seconds", "pneuma_build_info", "pneuma_connections_refused_total"}) {
    EXPECT_TRUE(types.contains(wanted)) << wanted;
  }
  EXPECT_NE(page.find("pneuma_build_info{version=\""), std::string::npos) << page;
}

TEST(MetricFamilies, TheWorstOfAllWorldsIsToldAndEachByName) {
  WorldStatus late = status_of("late", 0.25, 0.5);
  late.behind_checkpoint_of = MetricTime{} + seconds(10);
  WorldStatus damaged;
  damaged.listing.set_name("damaged");
  damaged.listing.set_damaged(true);
  const std::string page = page_of({damaged, late, status_of("well")}, MetricTime{} + seconds(22));
  for (const char* line :
       {"pneuma_latest_world_lateness_seconds 0.25\n", "pneuma_slowest_world_time_ratio 0.5\n",
        "pneuma_oldest_checkpoint_age_seconds 12\n", "pneuma_world_lateness_seconds{world=\"late\"} 0.25\n",
        "pneuma_world_time_ratio{world=\"well\"} 1\n", "pneuma_world_checkpoint_age_seconds{world=\"late\"} 12\n",
        "pneuma_world_checkpoint_age_seconds{world=\"well\"} 0\n"}) {
    EXPECT_NE(page.find(line), std::string::npos) << line << page;
  }
  EXPECT_EQ(page.find("world=\"damaged\""), std::string::npos);
}

TEST(MetricFamilies, WorldsAreBoundedInNumberAndNamelessWhereThatIsAsked) {
  std::vector<WorldStatus> worlds;
  for (std::size_t i = 0; i < 2 * labelled_worlds_max; ++i)
    worlds.push_back(status_of(std::string("w").append(std::to_string(i))));
  worlds.back().lateness_s = 3.0;
  const std::string page = page_of(worlds);
  std::size_t series = 0;
  for (auto at = page.find("{world="); at != std::string::npos; at = page.find("{world=", at + 1)) ++series;
  EXPECT_EQ(series, 3 * labelled_worlds_max);
  EXPECT_NE(page.find("pneuma_latest_world_lateness_seconds 3\n"), std::string::npos) << "of all, named or not";
  const std::string hidden = page_of(worlds, {}, [](std::string_view) { return false; });
  EXPECT_EQ(hidden.find("{world="), std::string::npos);
  EXPECT_NE(hidden.find("pneuma_latest_world_lateness_seconds 3\n"), std::string::npos);
}

TEST(MetricFamilies, TheDashboardAndTheAlertsAskForNothingElse) {
  const auto types = types_on(page_of({status_of("w")}));
  const std::regex name("(pneuma|process)_[a-z0-9_]+");
  for (const char* file : {"grafana.json", "alerts.yml"}) {
    SCOPED_TRACE(file);
    std::ifstream in(std::string(PNEUMA_SOURCE_DIR "/docker/") + file);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    std::set<std::string> asked;
    for (std::sregex_iterator found(text.begin(), text.end(), name), end; found != end; ++found) {
      std::string family = found->str();
      if (family.ends_with("_bucket")) family.resize(family.size() - 7);
      asked.insert(family);
    }
    EXPECT_GE(asked.size(), 8U);
    for (const std::string& family : asked) EXPECT_TRUE(types.contains(family)) << family;
  }
}

}  // namespace
}  // namespace pneuma::app
