#include "app/replay_log.h"

#include <spdlog/spdlog.h>

#include "app/log.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;

Status replay_log(const std::string& world, const std::vector<persist::LogRecord>& records, LiveWorld& live,
                  bool& paused, const LiveWorld::Admit& admit, const ReplayOptions& options) {
  physics::Workers workers(1);
  const auto step_to = [&](std::uint64_t tick) -> Status {
    while (live.tick() < tick) {
      if (options.is_over != nullptr && *options.is_over) return {StatusCode::unavailable, "the server shuts down"};
      live.physics().step_tick(workers);
    }
    return {};
  };
  for (const persist::LogRecord& record : records) {
    if (options.until_tick && record.tick >= *options.until_tick) break;
    v1::ClientMessage message;
    if (record.tick < live.tick() || !message.ParseFromString(record.bytes)) {
      return {StatusCode::malformed, "a command of tick " + std::to_string(record.tick) + " does not fit"};
    }
    if (Status ended = step_to(record.tick); !ended.ok()) return ended;
    if (message.has_pause()) paused = true;
    if (message.has_resume()) paused = false;
    if (!LiveWorld::is_change(message)) continue;
    if (const auto effect = live.change(message, admit); !effect.ok()) {
      spdlog::warn("world={} tick={} replay: {}", log_name(world), record.tick, effect.status().message());
    }
  }
  return options.until_tick ? step_to(*options.until_tick) : Status();
}

}  // namespace pneuma::app
