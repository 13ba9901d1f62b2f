#include "app/world_registry.h"

#include <algorithm>
#include <utility>

#include "base/limits.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;

Status WorldRegistry::check_room(const std::string& client) const {
  if (worlds_.size() >= worlds_max_) {
    return {StatusCode::limit_exceeded, "the server has its " + std::to_string(worlds_max_) + " worlds already"};
  }
  if (client.empty()) return {};
  const std::size_t most = worlds_max_ - worlds_max_ / base::worlds_kept_from_client;
  const auto own = std::ranges::count(worlds_, client, [](const auto& of) { return of.second.client; });
  if (static_cast<std::size_t>(own) < most) return {};
  return {StatusCode::limit_exceeded, "you have " + std::to_string(own) + " of the server's " +
                                          std::to_string(worlds_max_) + " worlds; the others are for other clients"};
}

Status WorldRegistry::reserve(const std::string& name, const std::string& client) {
  const std::lock_guard lock(mutex_);
  if (worlds_.contains(name)) return {StatusCode::already_exists, "there is a world " + name};
  if (auto status = check_room(client); !status.ok()) return status;
  worlds_[name].client = client;
  return {};
}

Status WorldRegistry::reserve_restoring(const std::string& name) {
  if (auto status = reserve(name); !status.ok()) return status;
  const std::lock_guard lock(mutex_);
  worlds_[name].restoring = true;
  return {};
}

base::Result<std::string> WorldRegistry::reserve_like(const std::string& wanted, const std::string& client) {
  const std::lock_guard lock(mutex_);
  if (auto status = check_room(client); !status.ok()) return status;
  std::string name = wanted;
  for (std::size_t i = 2; worlds_.contains(name); ++i) name = wanted + "-" + std::to_string(i);
  worlds_[name].client = client;
  return name;
}

void WorldRegistry::put(std::shared_ptr<HostedWorld> world, std::shared_ptr<Scheduler::Task> task) {
  const std::lock_guard lock(mutex_);
  Entry& place = worlds_[world->name()];
  place = {std::move(world), std::move(task), false, false, std::move(place.client)};
}

void WorldRegistry::put_damaged(const std::string& name) {
  const std::lock_guard lock(mutex_);
  Entry& place = worlds_[name];
  place = {};
  place.damaged = true;
}

void WorldRegistry::erase(const std::string& name) {
  const std::lock_guard lock(mutex_);
  worlds_.erase(name);
}

WorldRegistry::Entry WorldRegistry::find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = worlds_.find(name);
  return found == worlds_.end() ? Entry{} : found->second;
}

std::vector<WorldRegistry::Entry> WorldRegistry::all() const {
  const std::lock_guard lock(mutex_);
  std::vector<Entry> entries;
  for (const auto& [name, entry] : worlds_) {
    if (entry.world != nullptr) entries.push_back(entry);
  }
  return entries;
}

std::vector<std::string> WorldRegistry::names_where(bool Entry::* holds) const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> names;
  for (const auto& [name, entry] : worlds_) {
    if (entry.*holds) names.push_back(name);
  }
  return names;
}

std::uint32_t WorldRegistry::take_stream_id(const std::string& world) {
  const std::lock_guard lock(mutex_);
  // Counts round in the end; by then the early ones are long gone, and those that live are passed over.
  do {
    ++last_stream_id_;
  } while (last_stream_id_ == 0 || streams_.contains(last_stream_id_));
  streams_.emplace(last_stream_id_, world);
  return last_stream_id_;
}

void WorldRegistry::drop_stream_id(std::uint32_t stream_id) {
  const std::lock_guard lock(mutex_);
  streams_.erase(stream_id);
}

WorldRegistry::Entry WorldRegistry::find_stream(std::uint32_t stream_id) const {
  const std::lock_guard lock(mutex_);
  const auto stream = streams_.find(stream_id);
  if (stream == streams_.end()) return {};
  const auto found = worlds_.find(stream->second);
  return found == worlds_.end() ? Entry{} : found->second;
}

}  // namespace pneuma::app
