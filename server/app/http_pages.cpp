#include "app/http_pages.h"

#include <string>

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
  line.append("  tick ").append(std::to_string(world.tick()));
  line.append("  ").append(std::to_string(world.vertices())).append(" vertices");
  if (world.paused()) line.append("  paused");
  if (world.frozen_bodies() > 0) line.append("  ").append(std::to_string(world.frozen_bodies())).append(" frozen");
  return line;
}

}  // namespace

net::HttpReply start_page(const std::vector<WorldStatus>& worlds) {
  std::string body("pneuma-server ");
  body.append(base::version).append("\n\n");
  body += "/worlds   this page\n";
  body += "/ws       protocol pneuma.v1, one message a WebSocket message\n";
  body += "/healthz  200 while every running world ticks, and the disk takes what is to be kept\n";
  body += "/metrics  for Prometheus\n\n";
  body.append(std::to_string(worlds.size())).append(worlds.size() == 1 ? " world\n" : " worlds\n");
  for (const WorldStatus& world : worlds) body.append(line_of(world.listing)).append("\n");
  return net::text_reply(200, std::move(body));
}

net::HttpReply health_page(const std::vector<WorldStatus>& worlds, std::chrono::steady_clock::time_point now) {
  std::string silent;
  std::string not_kept;
  std::string damaged;
  for (const WorldStatus& world : worlds) {
    if (world.listing.damaged()) {
      damaged += "world " + world.listing.name() + " is damaged and not served\n";
    } else if (!world.listing.paused() && world.last_active + tick_silence_max < now) {
      silent += "world " + world.listing.name() + " has not ticked for " +
                std::to_string(std::chrono::duration_cast<std::chrono::seconds>(now - world.last_active).count()) +
                " s\n";
    }
    if (!world.disk_trouble.empty()) {
      not_kept += "world " + world.listing.name() + " cannot be kept: " + world.disk_trouble + "\n";
    }
  }
  if (!silent.empty() || !not_kept.empty()) return net::text_reply(503, silent + not_kept + damaged);
  return net::text_reply(200, "ok\n" + damaged);
}

net::HttpReply metrics_page(const Metrics& metrics) {
  return net::text_reply(200, metrics.text(), "text/plain; version=0.0.4; charset=utf-8");
}

}  // namespace pneuma::app
