#include "app/world_archive.h"

#include <optional>
#include <utility>

#include <spdlog/spdlog.h>

#include "app/log.h"
#include "app/replay_log.h"
#include "app/request_fields.h"
#include "app/saved_world.h"

namespace pneuma::app {

using base::Result;
using base::Status;
using base::StatusCode;

Result<WorldArchive> WorldArchive::open(const std::string& data_dir, std::chrono::duration<double> checkpoint_interval,
                                        persist::Sync sync, BackgroundQueue& disk, Metrics& metrics,
                                        persist::Files& files) {
  auto opened = persist::DataDir::open(data_dir, files);
  if (!opened.ok()) return opened.status();
  auto held = std::make_unique<persist::DataDir>(std::move(*opened));
  for (const Status& left : held->left()) spdlog::warn("left over: {}", left.message());
  const WorldJournal::Wiring wiring{held.get(), &disk, &metrics, checkpoint_interval, sync};
  return WorldArchive(std::move(held), wiring);
}

Result<std::vector<std::string>> WorldArchive::names() const {
  auto names = data_dir_->list_worlds();
  if (!names.ok()) return names;
  std::erase_if(*names, [](const std::string& name) {
    const Status wrong = check_world_name(name, log_name(name));
    if (!wrong.ok()) spdlog::warn("no world, left alone: {}", wrong.message());
    return !wrong.ok();
  });
  return names;
}

Result<WorldArchive::Restored> WorldArchive::restore(const std::string& name, const WorldMemory::Limits& room,
                                                     bool recover, const std::atomic<bool>& is_over) const {
  const auto recovered = persist::read_latest_checkpoint(*data_dir_, name);
  if (!recovered.ok()) return recovered.status();
  for (const Status& damaged : recovered->damaged)
    spdlog::warn("world={} passed over: {}", log_name(name), damaged.message());
  const auto saved = from_bytes(recovered->checkpoint.bytes);
  if (!saved.ok()) return saved.status();
  WorldMemory memory(room);
  const auto take_over = [&memory](const v1::Scene& source, const physics::Scene& scene) {
    memory.take_over(source, scene);
    return Status();
  };
  auto live = LiveWorld::restore(saved->live, take_over);
  if (!live.ok()) return live.status();

  auto commands = persist::read_commands(*data_dir_, name, recovered->checkpoint.sequence);
  if (!commands.ok()) return commands.status();
  bool paused = saved->paused;
  Status damage = commands->damage.value_or(Status());
  if (damage.ok() || recover) {
    if (commands->torn) spdlog::warn("world={} log cut: {}", log_name(name), commands->torn->message());
    const ReplayOptions options{std::nullopt, &is_over};
    if (Status ended = replay_log(name, commands->records, *live, paused, take_over, options); !ended.ok()) {
      damage = ended;
    }
    if (is_over) return Status(StatusCode::unavailable, "the server shuts down");
  }
  if (!damage.ok() || !recovered->damaged.empty()) {
    wiring_.metrics->damaged_files.Increment(static_cast<double>(recovered->damaged.size() + (damage.ok() ? 0 : 1)));
    if (!damage.ok() && !recover) return damage;
    // Nothing that is damaged is removed with what is old, whether it could be made up for or not.
    if (Status failed = data_dir_->keep_aside(name); !failed.ok()) return failed;
  }
  if (!damage.ok()) {
    spdlog::warn("world={} tick={} recovered up to the damage, its files kept aside: {}", log_name(name), live->tick(),
                 damage.message());
  }

  std::optional<persist::CommandLog> log;
  if (commands->end && damage.ok()) {
    auto resumed = persist::CommandLog::resume(*data_dir_, name, *commands->end, wiring_.sync);
    if (!resumed.ok()) return resumed.status();
    log.emplace(std::move(*resumed));
  }
  const std::uint64_t next_sequence = damage.ok() ? commands->next_sequence : recovered->next_sequence;
  auto journal = std::make_unique<WorldJournal>(name, next_sequence, wiring_, std::move(log));
  if (!damage.ok()) journal->forget_past();
  const Status kept = journal->checkpoint_now(live->save(), paused);
  // The log of before goes on; but one that is damaged cannot.
  if (!kept.ok() && !damage.ok()) return kept;
  memory.settle(true, live->physics().integrator(), 0.0);
  return Restored{name, std::move(*live), paused, std::move(journal), std::move(memory)};
}

Result<std::unique_ptr<WorldJournal>> WorldArchive::begin(const std::string& name, const LiveWorld& live, bool paused) {
  auto journal = std::make_unique<WorldJournal>(name, 0, wiring_);
  if (Status failed = journal->checkpoint_now(live.save(), paused); !failed.ok()) {
    (void)journal->remove();
    return Status(StatusCode::unavailable, "the server cannot keep the world: " + failed.message());
  }
  return journal;
}

}  // namespace pneuma::app
