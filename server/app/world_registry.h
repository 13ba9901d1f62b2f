// Which worlds there are, by name, and which stream belongs to which. Any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "app/hosted_world.h"
#include "app/scheduler.h"
#include "base/status.h"

namespace pneuma::app {

class WorldRegistry {
 public:
  struct Entry {
    std::shared_ptr<HostedWorld> world;  // null: there is none, it is still being built, or it is damaged
    std::shared_ptr<Scheduler::Task> task;
    bool damaged = false;     // what is kept of it could not be read
    bool restoring = false;   // it is being brought back
    std::string client = {};  // who made it; empty: the server itself
  };

  explicit WorldRegistry(std::size_t worlds_max) : worlds_max_(worlds_max) {}

  /// Takes a name for a world to come. Refuses a taken one, and one world too many: in all, or of the client's.
  [[nodiscard]] base::Status reserve(const std::string& name, const std::string& client = {});
  /// Takes `wanted`, or the first free one of wanted-2, wanted-3...
  [[nodiscard]] base::Result<std::string> reserve_like(const std::string& wanted, const std::string& client = {});
  /// Takes the name of a world that is being brought back.
  [[nodiscard]] base::Status reserve_restoring(const std::string& name);
  /// The world of a name that was taken.
  void put(std::shared_ptr<HostedWorld> world, std::shared_ptr<Scheduler::Task> task);
  /// The world is gone, or could not be brought back, and what is kept of it is still there.
  void put_damaged(const std::string& name);
  void erase(const std::string& name);

  [[nodiscard]] Entry find(const std::string& name) const;
  /// By name, in order; those still being built, and the damaged ones, are left out.
  [[nodiscard]] std::vector<Entry> all() const;
  // Names, in order.
  [[nodiscard]] std::vector<std::string> damaged() const { return names_where(&Entry::damaged); }
  [[nodiscard]] std::vector<std::string> restoring() const { return names_where(&Entry::restoring); }

  [[nodiscard]] std::uint32_t take_stream_id(const std::string& world);
  void drop_stream_id(std::uint32_t stream_id);
  [[nodiscard]] Entry find_stream(std::uint32_t stream_id) const;

 private:
  [[nodiscard]] base::Status check_room(const std::string& client) const;
  [[nodiscard]] std::vector<std::string> names_where(bool Entry::* holds) const;

  const std::size_t worlds_max_;
  mutable std::mutex mutex_;
  std::map<std::string, Entry> worlds_;
  std::map<std::uint32_t, std::string> streams_;
  std::uint32_t last_stream_id_ = 0;
};

}  // namespace pneuma::app
