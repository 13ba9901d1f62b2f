#include "app/world_journal.h"

#include <utility>

#include <spdlog/spdlog.h>

#include "app/saved_world.h"

namespace pneuma::app {

WorldJournal::WorldJournal(std::string world, std::uint64_t next_sequence, Wiring wiring)
    : world_(std::move(world)), wiring_(wiring), next_sequence_(next_sequence) {}

void WorldJournal::append(std::uint64_t tick, const v1::ClientMessage& message) {
  appended_ = true;
  if (!log_) return;  // the disk refused it, as was reported; the next checkpoint tries again
  base::Status status = log_->append(tick, message.SerializeAsString());
  if (status.ok()) status = log_->commit();
  report(status);
}

void WorldJournal::note_tick(std::uint64_t tick) {
  v1::ClientMessage stepped;
  stepped.mutable_step()->set_world(world_);
  append(tick, stepped);
}

bool WorldJournal::checkpoint_due(TimePoint now, std::uint64_t tick) const {
  return now - last_checkpoint_ >= wiring_.checkpoint_interval && (appended_ || tick != last_tick_) && !*writing_;
}

void WorldJournal::checkpoint(TimePoint now, LiveWorld::Saved saved, bool paused) {
  if (auto write = begin(now, std::move(saved), paused)) wiring_.disk->post(std::move(write));
}

void WorldJournal::checkpoint_now(LiveWorld::Saved saved, bool paused) {
  if (auto write = begin(std::chrono::steady_clock::now(), std::move(saved), paused)) write();
}

std::function<void()> WorldJournal::begin(TimePoint now, LiveWorld::Saved saved, bool paused) {
  last_checkpoint_ = now;
  auto log = persist::CommandLog::start(*wiring_.data_dir, world_, next_sequence_, persist::Sync::none);
  report(log.status());
  // Without a new log the old one goes on: it is replayed on the checkpoint before, which stays the latest one. The
  // number is tried again, since a replay ends at the first log that is missing.
  if (!log.ok()) return nullptr;
  const std::uint64_t sequence = next_sequence_++;
  log_ = std::move(*log);
  last_tick_ = saved.tick;
  appended_ = false;

  *writing_ = true;
  auto world = std::make_shared<SavedWorld>(SavedWorld{std::move(saved), paused});
  return [wiring = wiring_, name = world_, world = std::move(world), sequence, writing = writing_] {
    const std::uint64_t tick = world->live.tick;
    const auto status = persist::write_checkpoint(*wiring.data_dir, name, {sequence, tick, to_bytes(*world)});
    *writing = false;
    if (status.ok()) return;
    wiring.metrics->disk_errors.Increment();
    spdlog::error("world={} tick={} checkpoint failed: {}", name, tick, status.message());
  };
}

void WorldJournal::remove() {
  log_.reset();
  report(wiring_.data_dir->remove_world(world_));
}

void WorldJournal::report(const base::Status& status) const {
  if (status.ok()) return;
  wiring_.metrics->disk_errors.Increment();
  spdlog::error("world={} disk: {}", world_, status.message());
}

}  // namespace pneuma::app
