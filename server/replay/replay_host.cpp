#include "replay/replay_host.h"

#include <utility>

#include "app/protocol.h"

namespace pneuma::replay {

using base::Status;
using base::StatusCode;
using std::chrono::steady_clock;

ReplayHost::ReplayHost(client::Playback playback, const PlayOptions& options, net::Server& server)
    : server_(server),
      world_(std::move(playback), options,
             {[this] { return ++last_stream_id_; }, [](std::uint32_t) {},
              [this](std::size_t /*vertices*/, std::function<void()> make) {
                coarsener_.post([this, make = std::move(make)] {
                  make();
                  wake();
                });
              }}) {}

ReplayHost::~ReplayHost() {
  ReplayHost::close();
}

Status ReplayHost::start() {
  if (Status begun = world_.begin(steady_clock::now()); !begun.ok()) return begun;
  thread_ = std::thread([this] { run(); });
  return {};
}

void ReplayHost::run() {
  app::Outbox outbox;
  std::unique_lock lock(mutex_);
  while (!closed_) {
    woken_ = false;
    lock.unlock();
    world_.drain(steady_clock::now(), outbox);
    world_.play(steady_clock::now(), outbox);
    outbox.deliver(server_);
    const auto due = world_.due();
    lock.lock();
    const auto ready = [this] { return woken_ || closed_; };
    if (due) {
      changed_.wait_until(lock, *due, ready);
    } else {
      changed_.wait(lock, ready);
    }
  }
}

void ReplayHost::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_one();
}

void ReplayHost::refuse(const app::Request& request, const Status& why) {
  server_.send(request.session->id(), app::serialise(app::error_reply(request.message->request_id(), why)));
}

void ReplayHost::create(app::Request request) {
  refuse(request, {StatusCode::failed_precondition, "a recording is played here: worlds are not made",
                   std::string(app::kind_of(*request.message))});
}

void ReplayHost::read_snapshot(app::Request request) {
  refuse(request, base::not_found("a recording is played here: it has no snapshots", "read_snapshot.snapshot_id"));
}

bool ReplayHost::ask(const std::string& world, app::Request request) {
  const std::string field = std::string(app::kind_of(*request.message)) + ".world";
  if (world != world_.name()) {
    refuse(request, base::not_found("no world " + world, field));
    return false;
  }
  const auto posted = world_.post(request);
  if (posted == app::Inbox::Post::taken) {
    wake();
    return true;
  }
  refuse(request, {StatusCode::unavailable,
                   posted == app::Inbox::Post::full ? "too many requests wait" : "the server shuts down", field});
  return false;
}

bool ReplayHost::ask_stream(std::uint32_t, app::Request request) {
  return ask(world_.name(), std::move(request));
}

void ReplayHost::key_wanted(net::SessionId session, std::uint32_t stream_id) {
  if (world_.post(app::KeyWanted{session, stream_id}) == app::Inbox::Post::taken) wake();
}

void ReplayHost::stream_stalled(net::SessionId session, std::uint32_t stream_id) {
  if (world_.post(app::StreamStalled{session, stream_id}) == app::Inbox::Post::taken) wake();
}

void ReplayHost::reader_report(net::SessionId session, const net::ReaderReport& report) {
  (void)world_.post(app::ReaderReported{session, report});
}

void ReplayHost::session_ended(net::SessionId session, const std::string&) {
  if (world_.post(app::SessionEnded{session}) == app::Inbox::Post::taken) wake();
}

void ReplayHost::close() {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(closed_, true)) return;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
  app::Outbox outbox;
  world_.close({StatusCode::unavailable, "the server shuts down"}, outbox);
  outbox.deliver(server_);
}

}  // namespace pneuma::replay
