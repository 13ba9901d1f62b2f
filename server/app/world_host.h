// Hosts the worlds: the loop that each of them goes through, and their coming and going.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/background_queue.h"
#include "app/config.h"
#include "app/host.h"
#include "app/hosted_world.h"
#include "app/metrics.h"
#include "app/outbox.h"
#include "app/scheduler.h"
#include "app/session.h"
#include "app/snapshot_shelf.h"
#include "app/world_archive.h"
#include "app/world_memory.h"
#include "app/world_moment.h"
#include "app/world_registry.h"
#include "app/world_room.h"
#include "base/memory_budget.h"
#include "base/status.h"
#include "net/server.h"

namespace pneuma::app {

class WorldHost final : public Host {
 public:
  /// What became of the kept worlds, when the last of them is up.
  struct Restored {
    std::size_t up = 0;
    std::size_t damaged = 0;
  };
  using OnRestored = std::function<void(const Restored&)>;

  /// `config`, `server` and `metrics` must outlive the host. `on_restored` is called once, on a thread of the host,
  /// where there is a data directory.
  WorldHost(const Config& config, net::Server& server, Metrics& metrics, OnRestored on_restored = nullptr);
  ~WorldHost() override;
  WorldHost(const WorldHost&) = delete;
  WorldHost& operator=(const WorldHost&) = delete;

  /// Begins to bring back the worlds of the data directory, and adds one for each `--scene NAME|FILE`, unless there was
  /// one of that name. A world that cannot be brought back is logged, listed as damaged and left as it lies there.
  [[nodiscard]] base::Status start() override;

  void create(Request request) override;
  bool ask(const std::string& world, Request request) override;
  bool ask_stream(std::uint32_t stream_id, Request request) override;
  void read_snapshot(Request request) override;
  void key_wanted(net::SessionId session, std::uint32_t stream_id) override;
  void stream_stalled(net::SessionId session, std::uint32_t stream_id) override;
  void reader_report(net::SessionId session, const net::ReaderReport& report) override;
  void session_ended(net::SessionId session, const std::string& world) override;
  void end_owned(const std::shared_ptr<Session>& session, const std::string& world) override;
  [[nodiscard]] std::vector<WorldStatus> statuses() const override;
  [[nodiscard]] bool has(const std::string& world) const override { return registry_.find(world).world != nullptr; }

  /// Requests that wait are carried out where that was under way, or else refused. The ticks under way are finished and
  /// their events told.
  void close() override;
  /// Writes a last checkpoint of every world.
  [[nodiscard]] base::Status stop() override;

 private:
  using TimePoint = Scheduler::TimePoint;
  // What those worlds hold together that one client made, and what else is counted by client.
  struct Client {
    base::MemoryBudget memory;
    std::shared_ptr<TimeBudget> time;
    std::size_t looking_back = 0;  // its requests under way
  };

  // world_host_kept.cpp: what was there when the server began.
  /// Takes the names of what is kept.
  [[nodiscard]] base::Status find_kept();
  void restore_kept();
  void restore(const std::string& name);
  void tell_restored();
  /// A kept world of the scene's name is passed over once.
  [[nodiscard]] base::Status add_scene(const std::string& name_or_file, std::set<std::string>& passed_over);
  void run_slice(HostedWorld& world, const Scheduler::Turn& turn, Outbox& outbox);
  Scheduler::Next run_guarded(HostedWorld& world, const Scheduler::Turn& turn);
  void bury(HostedWorld& world);
  void bury_damaged(const std::string& name, const Request& request);
  void create_now(const Request& request);
  void create_scene(const Request& request);
  /// The name that is asked for, or one like the other where none is. Where that fails, the request is refused.
  [[nodiscard]] std::optional<std::string> reserve(const Request& request, const std::string& asked,
                                                   const std::string& otherwise);

  // world_host_past.cpp: what is asked about a world's past.
  struct LookBack;
  struct LookBackPlace;
  /// Null where too many are under way: in all, or of the client's.
  [[nodiscard]] std::unique_ptr<LookBackPlace> take_look_back_place(const std::string& client);
  void give_back_place(const std::string& client);
  [[nodiscard]] base::Status look_back(const std::string& world, const Request& request,
                                       const std::function<WorldMoment()>& moment);
  void read_past(LookBack& asked);
  void answer_look_back(LookBack& asked);
  [[nodiscard]] base::Status take_snapshot(LookBack& asked);
  [[nodiscard]] base::Status branch(LookBack& asked);
  [[nodiscard]] base::Status rewind(LookBack& asked);
  [[nodiscard]] base::Result<LiveWorld> replay_to(const LookBack& asked, std::uint64_t tick, bool& paused,
                                                  WorldMemory& memory) const;
  [[nodiscard]] base::Status restore_file(const Request& request);
  /// Hosts a world under a name that is asked for, and answers the request.
  [[nodiscard]] base::Status adopt(const Request& request, const std::string& asked_name, const std::string& otherwise,
                                   LiveWorld live, bool paused, WorldRoom room);

  /// With a journal where there is an archive. The name was reserved, and is given back where it fails.
  [[nodiscard]] base::Status keep_and_host(const std::string& name, LiveWorld live, bool paused, WorldRoom room,
                                           std::optional<net::SessionId> owner = std::nullopt);
  void host(const std::string& name, LiveWorld live, bool paused, std::unique_ptr<WorldJournal> journal, WorldRoom room,
            std::optional<net::SessionId> owner = std::nullopt);
  /// With an `owner`, nothing is kept of it: it ends with that session.
  [[nodiscard]] base::Result<std::vector<v1::MendedMesh>> build(const std::string& name, v1::Scene scene, bool paused,
                                                                WorldRoom room,
                                                                std::optional<net::SessionId> owner = std::nullopt);
  /// For a world that no client made.
  [[nodiscard]] WorldRoom own_room() const;
  /// A part of the room that a client's worlds have together.
  [[nodiscard]] WorldRoom room_of(const std::string& client);
  /// What a client's worlds may take together.
  [[nodiscard]] base::MemoryBudget memory_of(const std::string& client);
  /// With clients_mutex_ held.
  [[nodiscard]] Client& client_of(const std::string& name);
  void refuse(const Request& request, const base::Status& why, double retry_after_s = 0.0);
  void refuse(const Request& request, const v1::Error& why);

  const Config& config_;
  net::Server& server_;
  Metrics& metrics_;
  const base::MemoryBudget memory_;  // of all worlds
  WorldRegistry registry_;
  std::optional<WorldArchive> archive_;  // where there is a data directory
  std::set<std::string> kept_;           // the worlds found there
  std::atomic<bool> closed_ = false;
  bool stopped_ = false;
  std::mutex clients_mutex_;
  std::map<std::string, Client> clients_;
  SnapshotShelf snapshots_{memory_};
  const OnRestored on_restored_;
  std::atomic<std::size_t> to_restore_ = 0;  // kept worlds that are not up yet
  std::atomic<std::size_t> restored_ = 0;
  std::atomic<std::size_t> restored_damaged_ = 0;
  BackgroundQueue disk_;
  BackgroundQueue builder_{BackgroundQueue::Priority::low};
  BackgroundQueue coarsener_{BackgroundQueue::Priority::low};
  BackgroundQueue small_coarsener_{BackgroundQueue::Priority::low};  // of meshes that take milliseconds
  BackgroundQueue historian_{BackgroundQueue::Priority::low};        // replays
  BackgroundQueue filer_{BackgroundQueue::Priority::low};            // what is asked of the past and needs no replay
  std::deque<BackgroundQueue> restorers_;                            // while there is something to bring back
  const std::size_t threads_;                                        // that step worlds
  Scheduler scheduler_;                                              // last: its threads use the rest
};

}  // namespace pneuma::app
