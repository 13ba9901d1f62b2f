// What was there when the server began: the worlds of the data directory, which come back one by one while others run,
// and the scenes that it was started with.
#include <algorithm>
#include <exception>
#include <utility>

#include <spdlog/spdlog.h>

#include "app/log.h"
#include "app/request_fields.h"
#include "app/world_host.h"
#include "scene_io/load.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;

base::Status WorldHost::find_kept() {
  if (config_.data_dir.empty()) return {};
  auto archive = WorldArchive::open(config_.data_dir, config_.checkpoint_interval, config_.sync, disk_, metrics_);
  if (!archive.ok()) return archive.status();
  archive_.emplace(std::move(*archive));
  const auto names = archive_->names();
  if (!names.ok()) return names.status();
  // The names are taken from now on, so that no new world writes over what is kept of them.
  for (const std::string& name : *names) {
    if (auto status = registry_.reserve_restoring(name); !status.ok()) return status;
    kept_.insert(name);
  }
  return {};
}

// The worlds that are up go first: at a low priority.
void WorldHost::restore_kept() {
  if (!archive_) return;
  to_restore_ = kept_.size();
  metrics_.worlds_restoring.Set(static_cast<double>(kept_.size()));
  const std::size_t threads = std::clamp<std::size_t>(kept_.size(), 1, threads_);
  for (std::size_t i = 0; i < threads; ++i) restorers_.emplace_back(BackgroundQueue::Priority::low);
  if (kept_.empty()) return restorers_.front().post([this] { tell_restored(); });
  const auto names = std::make_shared<const std::vector<std::string>>(kept_.begin(), kept_.end());
  const auto next = std::make_shared<std::atomic<std::size_t>>(0);
  for (BackgroundQueue& restorer : restorers_) {
    restorer.post([this, names, next] {
      for (std::size_t i = (*next)++; i < names->size() && !closed_; i = (*next)++) restore((*names)[i]);
    });
  }
}

void WorldHost::restore(const std::string& name) {
  Status failed;
  try {
    auto world =
        archive_->restore(name, {memory_, config_.memory.world_bytes_max}, config_.recover.contains(name), closed_);
    if (world.ok()) {
      spdlog::info("world={} tick={} restored", log_name(name), world->live.tick());
      host(name, std::move(world->live), world->paused, std::move(world->journal),
           {std::move(world->memory), StepBudget(config_.step_time.world_processors)});
      ++restored_;
    } else {
      failed = world.status();
    }
  } catch (const std::exception& error) {
    failed = {StatusCode::internal, error.what()};
  }
  if (!failed.ok()) {
    if (closed_) return;
    spdlog::error(
        "world={} damaged, not served; its name and files stay until it is destroyed (--recover {} brings "
        "back what comes before the damage): {}",
        log_name(name), log_name(name), failed.message());
    registry_.put_damaged(name);
    metrics_.worlds_damaged.Increment();
    ++restored_damaged_;
  }
  metrics_.worlds_restoring.Decrement();
  if (--to_restore_ == 0) tell_restored();
}

void WorldHost::tell_restored() {
  const Restored restored{restored_, restored_damaged_};
  spdlog::info("worlds_up={} worlds_damaged={} all kept worlds are back", restored.up, restored.damaged);
  if (on_restored_) on_restored_(restored);
}

base::Status WorldHost::add_scene(const std::string& name_or_file, std::set<std::string>& passed_over) {
  auto scene = scene_io::load_scene(name_or_file);
  if (!scene.ok()) return scene.status();
  const std::string wanted = to_world_name(scene->name());
  if (kept_.contains(wanted) && passed_over.insert(wanted).second) {
    spdlog::info("world={} --scene {} adds nothing: the data directory keeps a world of that name", log_name(wanted),
                 name_or_file);
    return {};
  }
  auto name = registry_.reserve_like(wanted);
  if (!name.ok()) return scene_io::in_scene(name.status(), name_or_file);
  const auto built = build(*name, std::move(*scene), false, own_room());
  return built.ok() ? Status() : scene_io::in_scene(built.status(), name_or_file);
}

}  // namespace pneuma::app
