// Hosts one recording: a thread that shows its frames and answers its requests.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "app/background_queue.h"
#include "app/host.h"
#include "net/server.h"
#include "replay/replayed_world.h"

namespace pneuma::replay {

class ReplayHost final : public app::Host {
 public:
  /// `server` must outlive the host.
  ReplayHost(client::Playback playback, const PlayOptions& options, net::Server& server);
  ~ReplayHost() override;
  ReplayHost(const ReplayHost&) = delete;
  ReplayHost& operator=(const ReplayHost&) = delete;

  [[nodiscard]] const ReplayedWorld& world() const { return world_; }

  [[nodiscard]] base::Status start() override;
  void create(app::Request request) override;
  bool ask(const std::string& world, app::Request request) override;
  bool ask_stream(std::uint32_t stream_id, app::Request request) override;
  void read_snapshot(app::Request request) override;
  void key_wanted(net::SessionId session, std::uint32_t stream_id) override;
  void stream_stalled(net::SessionId session, std::uint32_t stream_id) override;
  void reader_report(net::SessionId session, const net::ReaderReport& report) override;
  void session_ended(net::SessionId session, const std::string& world) override;
  void end_owned(const std::shared_ptr<app::Session>&, const std::string&) override {}  // nobody makes worlds here
  [[nodiscard]] std::vector<app::WorldStatus> statuses() const override { return {world_.status()}; }
  [[nodiscard]] bool has(const std::string& world) const override { return world == world_.name(); }
  void close() override;
  [[nodiscard]] base::Status stop() override { return {}; }

 private:
  void run();
  void wake();
  void refuse(const app::Request& request, const base::Status& why);

  net::Server& server_;
  std::uint32_t last_stream_id_ = 0;
  ReplayedWorld world_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool woken_ = true;
  bool closed_ = false;
  std::thread thread_;
  app::BackgroundQueue coarsener_;  // last: its jobs wake the thread
};

}  // namespace pneuma::replay
