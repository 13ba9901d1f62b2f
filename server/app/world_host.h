// Hosts the worlds: the loop that each of them goes through, and their coming and going.
#pragma once

#include <atomic>
#include <map>
#include <memory>
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
#include "app/world_archive.h"
#include "app/world_memory.h"
#include "app/world_registry.h"
#include "base/memory_budget.h"
#include "base/status.h"
#include "net/server.h"

namespace pneuma::app {

class WorldHost final : public Host {
 public:
  /// `config`, `server` and `metrics` must outlive the host.
  WorldHost(const Config& config, net::Server& server, Metrics& metrics);
  ~WorldHost() override;
  WorldHost(const WorldHost&) = delete;
  WorldHost& operator=(const WorldHost&) = delete;

  /// Brings back the worlds of the data directory, and adds one for each `--scene NAME|FILE`, unless there was one of
  /// that name. A world that cannot be brought back is logged, listed as damaged and left as it lies there.
  [[nodiscard]] base::Status start() override;

  void create(Request request) override;
  bool ask(const std::string& world, Request request) override;
  bool ask_stream(std::uint32_t stream_id, Request request) override;
  void key_wanted(net::SessionId session, std::uint32_t stream_id) override;
  void reader_report(net::SessionId session, const net::ReaderReport& report) override;
  void session_ended(net::SessionId session, const std::string& world) override;
  [[nodiscard]] std::vector<WorldStatus> statuses() const override;
  [[nodiscard]] bool has(const std::string& world) const override { return registry_.find(world).world != nullptr; }

  /// Requests that wait are carried out where that was under way, or else refused. The ticks under way are finished and
  /// their events told.
  void close() override;
  /// Writes a last checkpoint of every world.
  [[nodiscard]] base::Status stop() override;

 private:
  using TimePoint = Scheduler::TimePoint;

  [[nodiscard]] base::Status restore();
  [[nodiscard]] base::Status add_scene(const std::string& name_or_file);
  Scheduler::Next run_slice(HostedWorld& world, Outbox& outbox);
  Scheduler::Next run_guarded(HostedWorld& world);
  void bury(HostedWorld& world);
  void bury_damaged(const std::string& name, const Request& request);
  void create_now(const Request& request);

  void host(const std::string& name, LiveWorld live, bool paused, std::unique_ptr<WorldJournal> journal,
            WorldMemory memory);
  [[nodiscard]] base::Result<std::vector<v1::MendedMesh>> build(const std::string& name, v1::Scene scene, bool paused,
                                                                WorldMemory memory);
  /// The room that a client's worlds have together.
  [[nodiscard]] WorldMemory::Limits room_of(const std::string& client);
  void refuse(const Request& request, const base::Status& why, double retry_after_s = 0.0);
  void refuse(const Request& request, const v1::Error& why);

  const Config& config_;
  net::Server& server_;
  Metrics& metrics_;
  const base::MemoryBudget memory_;  // of all worlds
  WorldRegistry registry_;
  std::optional<WorldArchive> archive_;  // where there is a data directory
  std::set<std::string> kept_;           // the worlds found there, until a --scene of that name has been passed over
  std::atomic<bool> closed_ = false;
  bool stopped_ = false;
  std::map<std::string, base::MemoryBudget> clients_;  // what each one's worlds hold; the building thread's
  BackgroundQueue disk_;
  BackgroundQueue builder_{BackgroundQueue::Priority::low};
  BackgroundQueue coarsener_{BackgroundQueue::Priority::low};
  Scheduler scheduler_;  // last: its threads use the rest
};

}  // namespace pneuma::app
