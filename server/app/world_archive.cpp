#include "app/world_archive.h"

#include <exception>
#include <optional>
#include <utility>

#include <spdlog/spdlog.h>

#include "app/saved_world.h"

namespace pneuma::app {

using base::Result;
using base::Status;
using base::StatusCode;

namespace {

// The commands at their ticks, on the state that they were given to: the same bits come out.
Status replay(const std::string& name, const std::vector<persist::LogRecord>& records, LiveWorld& live, bool& paused) {
  physics::Workers workers(1);
  for (const persist::LogRecord& record : records) {
    v1::ClientMessage message;
    if (record.tick < live.tick() || !message.ParseFromString(record.bytes)) {
      return {StatusCode::malformed, "a command of tick " + std::to_string(record.tick) + " does not fit"};
    }
    while (live.tick() < record.tick) live.physics().step_tick(workers);
    if (message.has_pause()) paused = true;
    if (message.has_resume()) paused = false;
    if (!LiveWorld::is_change(message)) continue;
    if (const auto effect = live.change(message); !effect.ok()) {
      spdlog::warn("world={} tick={} replay: {}", name, record.tick, effect.status().message());
    }
  }
  return {};
}

}  // namespace

Result<WorldArchive> WorldArchive::open(const std::string& data_dir, std::chrono::duration<double> checkpoint_interval,
                                        BackgroundQueue& disk, Metrics& metrics) {
  auto opened = persist::DataDir::open(data_dir);
  if (!opened.ok()) return opened.status();
  auto held = std::make_unique<persist::DataDir>(std::move(*opened));
  const WorldJournal::Wiring wiring{held.get(), &disk, &metrics, checkpoint_interval};
  return WorldArchive(std::move(held), wiring);
}

Result<WorldArchive::Found> WorldArchive::restore_all(std::size_t threads) {
  const auto names = data_dir_->list_worlds();
  if (!names.ok()) return names.status();
  std::vector<std::optional<Restored>> restored(names->size());
  physics::Workers workers(threads);
  const auto log_damage = [](const std::string& name, const std::string& why) {
    spdlog::error("world={} damaged, not served; its name and files stay until it is destroyed: {}", name, why);
  };
  workers.for_each(names->size(), [&](std::size_t i) {
    const std::string& name = (*names)[i];
    try {
      auto world = restore(name);
      if (world.ok()) {
        restored[i] = std::move(*world);
      } else {
        log_damage(name, world.status().message());
      }
    } catch (const std::exception& error) {
      log_damage(name, error.what());
    }
  });

  Found found;
  for (std::size_t i = 0; i < restored.size(); ++i) {
    if (restored[i]) {
      found.worlds.push_back(std::move(*restored[i]));
    } else {
      found.damaged.push_back((*names)[i]);
    }
  }
  return found;
}

Result<WorldArchive::Restored> WorldArchive::restore(const std::string& name) const {
  const auto recovered = persist::read_latest_checkpoint(*data_dir_, name);
  if (!recovered.ok()) return recovered.status();
  for (const Status& damaged : recovered->damaged) spdlog::warn("world={} passed over: {}", name, damaged.message());
  const auto saved = from_bytes(recovered->checkpoint.bytes);
  if (!saved.ok()) return saved.status();
  auto live = LiveWorld::restore(saved->live);
  if (!live.ok()) return live.status();

  const auto commands = persist::read_commands(*data_dir_, name, recovered->checkpoint.sequence);
  if (!commands.ok()) return commands.status();
  for (const Status& cut : commands->cut) spdlog::warn("world={} log cut: {}", name, cut.message());
  bool paused = saved->paused;
  if (auto status = replay(name, commands->records, *live, paused); !status.ok()) {
    spdlog::warn("world={} replay ended: {}", name, status.message());
  }

  auto journal = std::make_unique<WorldJournal>(name, recovered->next_sequence, wiring_);
  journal->checkpoint_now(live->save(), paused);
  return Restored{name, std::move(*live), paused, std::move(journal)};
}

std::unique_ptr<WorldJournal> WorldArchive::begin(const std::string& name, const LiveWorld& live, bool paused) {
  auto journal = std::make_unique<WorldJournal>(name, 0, wiring_);
  journal->checkpoint_now(live.save(), paused);
  return journal;
}

}  // namespace pneuma::app
