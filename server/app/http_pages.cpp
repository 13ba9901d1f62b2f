#include "app/http_pages.h"

#include <string>

#include "base/version.h"

namespace pneuma::app {

namespace {

// Longer than any tick of a world that is worth serving; at the slowest rate a tick comes each second.
constexpr std::chrono::seconds tick_silence_max{10};

}  // namespace

net::HttpReply start_page(const std::vector<WorldStatus>& worlds) {
  std::string body = "pneuma-server " + std::string(base::version) + "\n\n";
  body += "/ws       protocol pneuma.v1, one message a WebSocket message\n";
  body += "/healthz  200 while every running world ticks\n";
  body += "/metrics  for Prometheus\n\n";
  body += std::to_string(worlds.size()) + (worlds.size() == 1 ? " world\n" : " worlds\n");
  for (const WorldStatus& world : worlds) {
    body += world.listing.name() + "  tick " + std::to_string(world.listing.tick()) + "  " +
            std::to_string(world.listing.vertices()) + " vertices" + (world.listing.paused() ? "  paused" : "") + "\n";
  }
  return {200, "text/plain; charset=utf-8", std::move(body)};
}

net::HttpReply health_page(const std::vector<WorldStatus>& worlds, std::chrono::steady_clock::time_point now) {
  std::string silent;
  for (const WorldStatus& world : worlds) {
    if (!world.listing.paused() && world.last_active + tick_silence_max < now) {
      silent += "world " + world.listing.name() + " has not ticked for " +
                std::to_string(std::chrono::duration_cast<std::chrono::seconds>(now - world.last_active).count()) +
                " s\n";
    }
  }
  if (!silent.empty()) return {503, "text/plain; charset=utf-8", std::move(silent)};
  return {200, "text/plain; charset=utf-8", "ok\n"};
}

net::HttpReply metrics_page(const Metrics& metrics) {
  return {200, "text/plain; version=0.0.4; charset=utf-8", metrics.text()};
}

}  // namespace pneuma::app
