#include "app/http_pages.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <set>
#include <string>
#include <utility>

#include "app/world_clock.h"
#include "base/limits.h"
#include "base/version.h"

namespace pneuma::app {

namespace {

// From one tick to the next at the slowest rate in the slowest motion, and longer than any tick of a world that is
// worth serving takes.
constexpr double slowest_period_s = 1.0 / (base::rate_hz_min * WorldClock::time_scale_min);
constexpr std::chrono::seconds tick_silence_max{static_cast<int>(slowest_period_s) + 2};

std::string line_of(const v1::WorldList::World& world) {
  std::string line = world.name();
  if (world.damaged()) return line.append("  damaged");
  if (world.restoring()) return line.append("  is being brought back");
  line.append("  tick ").append(std::to_string(world.tick()));
  line.append("  ").append(std::to_string(world.vertices())).append(" vertices");
  if (world.paused()) line.append("  paused");
  if (world.frozen_bodies() > 0) line.append("  ").append(std::to_string(world.frozen_bodies())).append(" frozen");
  return line;
}

}  // namespace

net::HttpReply start_page(const std::vector<WorldStatus>& worlds, const MayName& may_name) {
  std::string body("pneuma-server ");
  body.append(base::version).append("\n\n");
  body += "/worlds   this page\n";
  body += "/ws       protocol pneuma.v1, one message a WebSocket message\n";
  body += "/healthz  200 while every running world ticks, and the disk takes what is to be kept\n";
  body += "/livez    200 while the server answers\n";
  body += "/readyz   200 once every kept world is back\n";
  body += "/metrics  for Prometheus\n\n";
  std::string lines;
  std::size_t count = 0;
  for (const WorldStatus& world : worlds) {
    if (!may_name(world.listing.name())) continue;
    lines.append(line_of(world.listing)).append("\n");
    ++count;
  }
  body.append(std::to_string(count)).append(count == 1 ? " world\n" : " worlds\n").append(lines);
  return net::text_reply(200, std::move(body));
}

net::HttpReply health_page(const std::vector<WorldStatus>& worlds, std::chrono::steady_clock::time_point now,
                           const MayName& may_name) {
  // Sets: all worlds that may not be named are one line.
  std::set<std::string> silent;
  std::set<std::string> not_kept;
  std::set<std::string> damaged;
  for (const WorldStatus& world : worlds) {
    if (world.listing.restoring()) continue;
    const bool is_named = may_name(world.listing.name());
    const std::string name = is_named ? "world " + world.listing.name() : "a world";
    if (world.listing.damaged()) {
      damaged.insert(name + " is damaged and not served\n");
    } else if (!world.listing.paused() && world.last_active + tick_silence_max < now) {
      const auto silence = std::chrono::duration_cast<std::chrono::seconds>(now - world.last_active);
      silent.insert(name + " has not ticked" + (is_named ? " for " + std::to_string(silence.count()) + " s\n" : "\n"));
    }
    if (!world.disk_trouble.empty()) {
      not_kept.insert(name + " cannot be kept" + (is_named ? ": " + world.disk_trouble + "\n" : "\n"));
    }
  }
  std::string text = silent.empty() && not_kept.empty() ? "ok\n" : "";
  for (const auto* lines : {&silent, &not_kept, &damaged}) {
    for (const std::string& line : *lines) text += line;
  }
  return net::text_reply(silent.empty() && not_kept.empty() ? 200 : 503, std::move(text));
}

net::HttpReply live_page() {
  return net::text_reply(200, "ok\n");
}

net::HttpReply ready_page(const std::vector<WorldStatus>& worlds) {
  const auto restoring =
      std::ranges::count_if(worlds, [](const WorldStatus& world) { return world.listing.restoring(); });
  const auto up = static_cast<std::ptrdiff_t>(worlds.size()) - restoring;
  return net::text_reply(restoring == 0 ? 200 : 503,
                         std::to_string(up) + " of " + std::to_string(worlds.size()) + " worlds are up\n");
}

net::HttpReply metrics_page(const Metrics& metrics, const std::vector<WorldStatus>& worlds,
                            std::chrono::steady_clock::time_point now, const MayName& may_name) {
  std::vector<prometheus::MetricFamily> also = world_families(worlds, now, may_name);
  std::ranges::move(process_families(), std::back_inserter(also));
  also.push_back(build_family());
  return net::text_reply(200, metrics.text(may_name, std::move(also)), "text/plain; version=0.0.4; charset=utf-8");
}

net::HttpReply token_wanted_page() {
  return net::text_reply(401, "this server asks for a token; say it in a header, Authorization: Bearer TOKEN\n");
}

}  // namespace pneuma::app
