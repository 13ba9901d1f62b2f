// Shows what the pages tell of worlds to who may not hear of them: nothing but that something is wrong.
#include "app/http_pages.h"

#include <chrono>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <prometheus/gauge.h>
#include <prometheus/registry.h>

namespace pneuma::app {
namespace {

const MayName nobody = [](std::string_view) { return false; };
const MayName lab_alone = [](std::string_view world) { return world == "lab"; };

WorldStatus status_named(const std::string& name) {
  WorldStatus status;
  status.listing.set_name(name);
  status.last_active = std::chrono::steady_clock::time_point(std::chrono::hours(1));
  return status;
}

TEST(HttpPages, HealthNamesTheWorldsThatMayBeNamed) {
  std::vector<WorldStatus> worlds{status_named("lab"), status_named("office"), status_named("cellar")};
  const auto then = worlds.front().last_active;
  EXPECT_EQ(*health_page(worlds, then, nobody).body, "ok\n");
  const auto late = health_page(worlds, then + std::chrono::minutes(2), lab_alone);
  EXPECT_EQ(late.status, 503);
  EXPECT_EQ(*late.body, "a world has not ticked\nworld lab has not ticked for 120 s\n");
  worlds[1].disk_trouble = "/secret/place: no space";
  worlds[2].listing.set_damaged(true);
  const auto troubled = health_page(worlds, then, nobody);
  EXPECT_EQ(troubled.status, 503);
  EXPECT_EQ(*troubled.body, "a world cannot be kept\na world is damaged and not served\n");
}

TEST(HttpPages, TheListHasTheWorldsThatMayBeNamed) {
  const std::vector<WorldStatus> worlds{status_named("lab"), status_named("office")};
  const std::string page = *start_page(worlds, lab_alone).body;
  EXPECT_NE(page.find("\n1 world\nlab  tick 0"), std::string::npos) << page;
  EXPECT_EQ(page.find("office"), std::string::npos) << page;
}

TEST(HttpPages, MetricsLeaveOutTheLabelsOfOtherWorlds) {
  prometheus::Registry registry;
  auto& late = prometheus::BuildGauge().Name("late").Help("Late.").Register(registry);
  for (const char* world : {"lab", "office"}) late.Add({{"world", world}}).Set(1);
  late.Add({{"kind", "office"}}).Set(2);
  const std::string text = metrics_text(registry.Collect(), lab_alone);
  EXPECT_NE(text.find("late{world=\"lab\"} 1"), std::string::npos) << text;
  EXPECT_NE(text.find("late{kind=\"office\"} 2"), std::string::npos) << text;
  EXPECT_EQ(text.find("world=\"office\""), std::string::npos) << text;
}

}  // namespace
}  // namespace pneuma::app
