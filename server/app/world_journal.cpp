#include "app/world_journal.h"

#include <algorithm>
#include <utility>

#include <spdlog/spdlog.h>

#include "app/log.h"
#include "app/saved_world.h"
#include "base/limits.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;

namespace {

// A disk that was full may take writes again soon.
constexpr std::chrono::seconds retry_interval{1};
constexpr std::chrono::seconds sync_interval{1};

}  // namespace

WorldJournal::WorldJournal(std::string world, std::uint64_t next_sequence, Wiring wiring,
                           std::optional<persist::CommandLog> log)
    : world_(std::move(world)), wiring_(wiring), next_sequence_(next_sequence), log_(std::move(log)) {}

Status WorldJournal::write(std::uint64_t tick, const v1::ClientMessage& message) {
  if (lacks_a_change()) return {StatusCode::unavailable, "the disk lacks an earlier change"};
  if (!log_) return log_trouble_;
  log_trouble_ = report(log_->write(tick, message.SerializeAsString()));
  written_ = written_ || log_trouble_.ok();
  return log_trouble_;
}

void WorldJournal::take_back() {
  // If it stays on the disk, a replay refuses it as it was refused now.
  log_trouble_ = report(log_->take_back());
}

Status WorldJournal::note_tick(std::uint64_t tick) {
  v1::ClientMessage stepped;
  stepped.mutable_step()->set_world(world_);
  return write(tick, stepped);
}

void WorldJournal::lost_a_change() {
  checkpoint_needed_ = next_sequence_;
  forget_past();
}

std::optional<persist::LogEnd> WorldJournal::log_end() const {
  if (!log_) return std::nullopt;
  return log_->end();
}

bool WorldJournal::lacks_a_change() const {
  if (!checkpoint_needed_) return false;
  const std::lock_guard lock(checkpoints_->mutex);
  return checkpoints_->next_sequence <= *checkpoint_needed_;
}

Status WorldJournal::trouble() const {
  if (!log_trouble_.ok()) return log_trouble_;
  const std::lock_guard lock(checkpoints_->mutex);
  return checkpoints_->trouble;
}

bool WorldJournal::checkpoint_due(TimePoint now, std::uint64_t tick) const {
  const bool has_trouble = !trouble().ok();
  const std::lock_guard lock(checkpoints_->mutex);
  if (checkpoints_->under_way) return false;
  if (has_trouble || is_log_long()) {
    return now - last_checkpoint_ >=
           std::min<std::chrono::duration<double>>(wiring_.checkpoint_interval, retry_interval);
  }
  return now - last_checkpoint_ >= wiring_.checkpoint_interval && (written_ || tick != last_tick_);
}

bool WorldJournal::is_log_long() const {
  return log_ && log_->end().bytes >= base::log_bytes_before_checkpoint;
}

std::optional<WorldJournal::TimePoint> WorldJournal::next_try(TimePoint now) const {
  const bool has_trouble = !trouble().ok();
  std::optional<TimePoint> next;
  if (log_ && log_->needs_sync()) next = last_sync_ + sync_interval;
  const std::lock_guard lock(checkpoints_->mutex);
  if (!has_trouble && !checkpoints_->under_way && !is_log_long()) return next;
  TimePoint retry = last_checkpoint_ + retry_interval;
  if (checkpoints_->under_way && retry <= now) retry = now + retry_interval;  // a slow disk
  return std::min(next.value_or(TimePoint::max()), retry);
}

void WorldJournal::sync_if_due(TimePoint now) {
  if (!log_ || !log_->needs_sync() || now < last_sync_ + sync_interval) return;
  last_sync_ = now;
  {
    const std::lock_guard lock(checkpoints_->mutex);
    if (checkpoints_->syncing) return;  // a disk that takes longer than a second; the next one covers what was written
    checkpoints_->syncing = true;
  }
  wiring_.disk->post([sync = log_->sync_job(), wiring = wiring_, world = world_, shared = checkpoints_] {
    Status failed = reported(wiring, world, sync());
    const std::lock_guard lock(shared->mutex);
    shared->syncing = false;
    if (!failed.ok()) shared->trouble = std::move(failed);  // a checkpoint makes up for it
  });
}

std::optional<WorldJournal::TimePoint> WorldJournal::behind_checkpoint_of(std::uint64_t tick) const {
  const std::lock_guard lock(checkpoints_->mutex);
  const bool is_written = !checkpoints_->under_way && checkpoints_->trouble.ok();
  if (is_written && !written_ && tick == last_tick_) return std::nullopt;
  return checkpoints_->at;
}

void WorldJournal::checkpoint(TimePoint now, LiveWorld::Saved saved, bool paused) {
  auto write = begin(now, std::move(saved), paused);
  if (write.ok()) wiring_.disk->post([write = std::move(*write)] { (void)write(); });
}

Status WorldJournal::checkpoint_now(LiveWorld::Saved saved, bool paused) {
  auto write = begin(std::chrono::steady_clock::now(), std::move(saved), paused);
  if (!write.ok()) return write.status();
  return (*write)();
}

// The new log first, then the old one's seal: a replay takes an empty log after one without a seal for one that was
// just begun. Where any of it fails the old log goes on; it is replayed on the checkpoint before, which stays the
// latest one. The new log stays then: the seal may have got to the disk all the same.
base::Result<std::function<Status()>> WorldJournal::begin_log() {
  auto log = persist::CommandLog::start(*wiring_.data_dir, world_, next_sequence_, wiring_.sync);
  if (!log.ok()) return log.status();
  if (log_) {
    if (Status failed = log_->seal(0); !failed.ok()) return failed;
  }
  std::function<Status()> sync_old;
  if (log_ && log_->needs_sync()) sync_old = log_->sync_job();
  log_ = std::move(*log);
  ++next_sequence_;
  return sync_old;
}

base::Result<std::function<Status()>> WorldJournal::begin(TimePoint now, LiveWorld::Saved saved, bool paused) {
  last_checkpoint_ = now;
  const std::uint64_t sequence = next_sequence_;
  auto begun = begin_log();
  log_trouble_ = report(begun.status());
  if (!log_trouble_.ok()) return log_trouble_;
  last_tick_ = saved.tick;
  written_ = false;
  {
    const std::lock_guard lock(checkpoints_->mutex);
    checkpoints_->under_way = true;
  }
  auto world = std::make_shared<SavedWorld>(SavedWorld{std::move(saved), paused});
  return std::function<Status()>([wiring = wiring_, name = world_, world = std::move(world), sequence,
                                  written = checkpoints_, sync_old = std::move(*begun)] {
    if (sync_old) (void)sync_old();  // if it fails, the checkpoint makes up for it
    const std::uint64_t tick = world->live.tick;
    Status status = persist::write_checkpoint(*wiring.data_dir, name, {sequence, tick, to_bytes(*world)});
    if (!status.ok()) {
      wiring.metrics->disk_errors.Increment();
      spdlog::error("world={} tick={} checkpoint failed: {}", log_name(name), tick, status.message());
    }
    const std::lock_guard lock(written->mutex);
    written->under_way = false;
    written->trouble = status;
    if (status.ok()) {
      written->next_sequence = sequence + 1;
      written->at = std::chrono::steady_clock::now();
    }
    return status;
  });
}

Status WorldJournal::remove() {
  log_.reset();
  return report(wiring_.data_dir->remove_world(world_));
}

Status WorldJournal::reported(const Wiring& wiring, const std::string& world, Status status) {
  if (!status.ok()) {
    wiring.metrics->disk_errors.Increment();
    spdlog::error("world={} disk: {}", log_name(world), status.message());
  }
  return status;
}

}  // namespace pneuma::app
