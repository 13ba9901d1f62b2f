#include "app/world_host.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <thread>
#include <utility>

#include <spdlog/spdlog.h>

#include "app/log.h"
#include "app/protocol.h"
#include "app/request_fields.h"
#include "app/scene_source.h"
#include "scene_io/load.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;
using std::chrono::steady_clock;

namespace {

// How long a heavy world may keep its thread when another one is due.
// Coarser versions of a mesh of so many vertices take some 50 ms to make; they do not wait for those of larger ones.
constexpr std::size_t small_mesh_vertices = 4'096;
constexpr std::chrono::milliseconds slice_length{2};
// How long it may keep it when none is, before it looks for a request that cannot wait.
constexpr std::chrono::milliseconds slice_length_max{100};

Status going_down() {
  return {StatusCode::unavailable, "the server shuts down"};
}

Scheduler::Next next_of(const HostedWorld& world, HostedWorld::TimePoint now) {
  if (const auto due = world.next_due(now)) return Scheduler::Next::at(*due);
  return Scheduler::Next::when_woken(world.next_try(now));
}

std::size_t thread_count(std::size_t asked_for) {
  if (asked_for > 0) return asked_for;
  return std::max<std::size_t>(1, std::thread::hardware_concurrency());
}

}  // namespace

// The loop. Each world goes through it at its own pace, on one thread at a time: drain commands -> step -> encode ->
// publish -> checkpoint.
void WorldHost::run_slice(HostedWorld& world, const Scheduler::Turn& turn, Outbox& outbox) {
  if (world.destroyed_by() != nullptr) return;  // woken by what came too late
  const TimePoint start = steady_clock::now();

  world.drain(start, start + slice_length, outbox);
  outbox.deliver(server_);
  if (world.destroyed_by() != nullptr) return bury(world);
  if (!world.tick_due(start)) return world.checkpoint(start, false);

  const auto give_way = [&] {
    const TimePoint now = steady_clock::now();
    return now >= start + slice_length_max || (now >= start + slice_length && (closed_ || turn.other_due(now)));
  };
  if (!world.step(give_way)) return;  // the tick goes on in a later slice

  world.encode(outbox);
  const TimePoint end = steady_clock::now();
  world.end_tick(end, outbox);

  outbox.deliver(server_);

  world.checkpoint(end, false);
}

// A world that throws must not take the others with it.
Scheduler::Next WorldHost::run_guarded(HostedWorld& world, const Scheduler::Turn& turn) {
  Outbox outbox;
  try {
    run_slice(world, turn, outbox);
    const TimePoint now = steady_clock::now();
    if (world.has_budget()) world.spend(now, turn.used());
    return next_of(world, now);
  } catch (const std::exception& error) {
    world.halt(error.what(), outbox);
    outbox.deliver(server_);
    return Scheduler::Next::when_woken();
  }
}

WorldHost::WorldHost(const Config& config, net::Server& server, Metrics& metrics, OnRestored on_restored)
    : config_(config),
      server_(server),
      metrics_(metrics),
      memory_(config.memory.worlds_bytes_max),
      registry_(config.limits.worlds_max),
      on_restored_(std::move(on_restored)),
      threads_(thread_count(config.threads)),
      scheduler_(threads_) {}

WorldHost::~WorldHost() {
  (void)WorldHost::stop();
}

base::Status WorldHost::start() {
  spdlog::info("memory_bytes={} for_worlds={} of_a_client={} of_a_world={}", config_.memory.bytes_max,
               config_.memory.worlds_bytes_max, config_.memory.client_bytes_max, config_.memory.world_bytes_max);
  if (auto status = find_kept(); !status.ok()) return status;
  std::set<std::string> passed_over;
  for (const std::string& scene : config_.scenes) {
    if (auto status = add_scene(scene, passed_over); !status.ok()) return status;
  }
  restore_kept();
  return {};
}

void WorldHost::create(Request request) {
  constexpr BackgroundQueue::Room room{base::world_builds_waiting_max, base::world_builds_waiting_bytes_max};
  const bool has_room =
      builder_.try_post([this, request] { create_now(request); }, request.bytes, room, request.session->client());
  if (!has_room) refuse(request, {StatusCode::unavailable, "too many worlds wait to be built"}, retry_hint_s);
}

void WorldHost::create_now(const Request& request) {
  if (closed_) return refuse(request, going_down(), retry_hint_s);
  try {
    if (!request.message->has_restore_world()) return create_scene(request);
    if (Status failed = restore_file(request); !failed.ok()) {
      refuse(request, failed, failed.code() == StatusCode::unavailable ? retry_hint_s : 0.0);
    }
  } catch (const std::exception& error) {
    spdlog::error("session={} {} threw: {}", request.session->id(), kind_of(*request.message), error.what());
    refuse(request, {StatusCode::internal, "the server failed at this request"});
  }
}

std::optional<std::string> WorldHost::reserve(const Request& request, const std::string& asked,
                                              const std::string& otherwise) {
  const std::string kind(kind_of(*request.message));
  const std::string field = kind + ".name";
  const Grant& grant = request.session->grant();
  const auto refused = [&](const auto& why, double hint_s = 0.0) {
    refuse(request, why, hint_s);
    return std::nullopt;
  };
  if (!asked.empty()) {
    if (auto status = check_world_name(asked, field); !status.ok()) return refused(status);
    if (const Denial denial = check_world(grant, asked, field)) {
      refuse(request, *denial);
      return std::nullopt;
    }
    if (auto status = registry_.reserve(asked, request.session->client()); !status.ok()) {
      return refused(status.inside(field), status.code() == StatusCode::limit_exceeded ? retry_hint_s : 0.0);
    }
    return asked;
  }
  const auto name = registry_.reserve_like(otherwise, request.session->client());
  if (!name.ok()) {
    return refused(name.status().inside(kind), name.status().code() == StatusCode::limit_exceeded ? retry_hint_s : 0.0);
  }
  if (const Denial denial = check_world(grant, *name, field)) {
    registry_.erase(*name);
    refuse(request, *denial);
    return std::nullopt;
  }
  return *name;
}

void WorldHost::create_scene(const Request& request) {
  const v1::CreateWorld& asked = request.message->create_world();
  auto scene = scene_of(asked);
  if (!scene.ok()) return refuse(request, scene.status());
  const auto name = reserve(request, asked.name(), to_world_name(scene->name()));
  if (!name) return;
  const auto owner = asked.owned() ? std::optional(request.session->id()) : std::nullopt;
  const auto mended = build(*name, std::move(*scene), asked.paused(), room_of(request.session->client()), owner);
  if (!mended.ok()) {
    const double hint_s = mended.status().code() == StatusCode::unavailable ? retry_hint_s : 0.0;
    return refuse(request, mended.status().inside(source_field(asked)), hint_s);
  }
  metrics_.count_command("create_world", "ok");
  spdlog::info("world={} session={} created", log_name(*name), request.session->id());
  server_.send(request.session->id(), serialise(done_reply(request.message->request_id(), 0, *name, {}, *mended)));
  if (asked.owned() && !request.session->own(*name)) end_owned(request.session, *name);
}

WorldRoom WorldHost::own_room() const {
  return {WorldMemory({memory_, config_.memory.world_bytes_max}), StepBudget(config_.step_time.world_processors)};
}

WorldHost::Client& WorldHost::client_of(const std::string& name) {
  const TimePoint now = steady_clock::now();
  // Who ends all of its worlds and begins anew gains no processor time.
  std::erase_if(clients_, [now](const auto& known) {
    const Client& client = known.second;
    return client.memory.bytes() == 0 && client.time->is_full(now) && client.looking_back == 0;
  });
  auto found = clients_.find(name);
  if (found == clients_.end()) {
    const auto time = std::make_shared<TimeBudget>(config_.step_time.client_processors);
    found = clients_.emplace(name, Client{{config_.memory.client_bytes_max, memory_}, time}).first;
  }
  return found->second;
}

WorldRoom WorldHost::room_of(const std::string& client) {
  const std::lock_guard lock(clients_mutex_);
  const Client& known = client_of(client);
  return {WorldMemory({known.memory, config_.memory.world_bytes_max}),
          StepBudget(config_.step_time.world_processors, known.time)};
}

base::MemoryBudget WorldHost::memory_of(const std::string& client) {
  const std::lock_guard lock(clients_mutex_);
  return client_of(client).memory;
}

/// Under a reserved name, which is given back where it fails. Tells what was done to meshes.
base::Result<std::vector<v1::MendedMesh>> WorldHost::build(const std::string& name, v1::Scene scene, bool paused,
                                                           WorldRoom room, std::optional<net::SessionId> owner) {
  try {
    auto live = LiveWorld::create(std::move(scene), [&room](const v1::Scene& source, const physics::Scene& checked) {
      return room.memory.admit(source, checked);
    });
    if (!live.ok()) {
      registry_.erase(name);
      return live.status();
    }
    room.memory.settle(true, live->physics().integrator(), 0.0);
    const std::vector<v1::MendedMesh> mended = live->mended();
    if (Status failed = keep_and_host(name, std::move(*live), paused, std::move(room), owner); !failed.ok()) {
      return failed;
    }
    for (const v1::MendedMesh& mesh : mended) {
      spdlog::info("world={} mesh={} mended: {}", log_name(name), log_name(mesh.mesh()), mesh.detail());
    }
    return mended;
  } catch (const std::exception& error) {
    registry_.erase(name);
    spdlog::error("world={} create threw: {}", log_name(name), error.what());
    return Status(StatusCode::internal, "the server failed at this scene");
  }
}

Status WorldHost::keep_and_host(const std::string& name, LiveWorld live, bool paused, WorldRoom room,
                                std::optional<net::SessionId> owner) {
  std::unique_ptr<WorldJournal> journal;
  if (archive_ && !owner) {
    auto begun = archive_->begin(name, live, paused);
    if (!begun.ok()) {
      registry_.erase(name);
      return begun.status();
    }
    journal = std::move(*begun);
  }
  host(name, std::move(live), paused, std::move(journal), std::move(room), owner);
  return {};
}

void WorldHost::host(const std::string& name, LiveWorld live, bool paused, std::unique_ptr<WorldJournal> journal,
                     WorldRoom room, std::optional<net::SessionId> owner) {
  HostedWorld::Wiring wiring;
  wiring.owner = owner;
  wiring.take_stream_id = [this, name] { return registry_.take_stream_id(name); };
  wiring.drop_stream_id = [this](std::uint32_t stream_id) { registry_.drop_stream_id(stream_id); };
  wiring.metrics = &metrics_;
  wiring.defer = [this, name](std::size_t vertices, std::function<void()> make) {
    BackgroundQueue& queue = vertices > small_mesh_vertices ? coarsener_ : small_coarsener_;
    queue.post([this, name, make = std::move(make)] {
      if (closed_) return;
      make();
      if (const auto entry = registry_.find(name); entry.world != nullptr) scheduler_.wake(entry.task);
    });
  };
  wiring.look_back = [this, name](const Request& request, const std::function<WorldMoment()>& moment) {
    return look_back(name, request, moment);
  };
  auto world = std::make_shared<HostedWorld>(name, std::move(live), paused, std::move(journal), std::move(wiring),
                                             std::move(room));
  auto task = scheduler_.add([this, world](const Scheduler::Turn& turn) { return run_guarded(*world, turn); });
  registry_.put(world, task);
  metrics_.worlds.Increment();
  scheduler_.wake(task);
}

// The name is free again when the files are gone.
void WorldHost::bury(HostedWorld& world) {
  const auto entry = registry_.find(world.name());
  disk_.post([this, world = entry.world] {
    const Request& request = *world->destroyed_by();
    if (Status failed = world->forget(); !failed.ok()) {
      // What is left of it would come back with the next start; so it is not gone, and may be destroyed again.
      registry_.put_damaged(world->name());
      metrics_.worlds.Decrement();
      metrics_.worlds_damaged.Increment();
      return refuse(
          request, {StatusCode::unavailable, "its files could not be removed: " + failed.what(), "destroy_world.world"},
          retry_hint_s);
    }
    registry_.erase(world->name());
    if (world->owner() == request.session->id()) request.session->disown(world->name());
    metrics_.worlds.Decrement();
    metrics_.count_command("destroy_world", "ok");
    spdlog::info("world={} session={} destroyed", log_name(world->name()), request.session->id());
    server_.send(request.session->id(),
                 serialise(done_reply(request.message->request_id(), world->status().listing.tick(), world->name())));
  });
}

// The name is free again when the files are gone.
void WorldHost::bury_damaged(const std::string& name, const Request& request) {
  disk_.post([this, name, request] {
    if (!registry_.find(name).damaged)
      return refuse(request, base::not_found("no world " + name, "destroy_world.world"));
    if (auto status = archive_->remove(name); !status.ok()) {
      metrics_.disk_errors.Increment();
      spdlog::error("world={} session={} not destroyed: {}", log_name(name), request.session->id(), status.message());
      return refuse(request, {StatusCode::internal, "its files could not be removed", "destroy_world.world"});
    }
    registry_.erase(name);
    metrics_.worlds_damaged.Decrement();
    metrics_.count_command("destroy_world", "ok");
    spdlog::info("world={} session={} destroyed", log_name(name), request.session->id());
    server_.send(request.session->id(), serialise(done_reply(request.message->request_id(), 0, name)));
  });
}

bool WorldHost::ask(const std::string& name, Request request) {
  const WorldRegistry::Entry entry = registry_.find(name);
  const auto& world = entry.world;
  const std::string world_field = std::string(kind_of(*request.message)) + ".world";
  if (entry.damaged) {
    if (request.message->has_destroy_world()) {
      bury_damaged(name, request);
    } else {
      refuse(request, {StatusCode::failed_precondition,
                       "world " + name + " could not be brought back from the server's disk; it can only be destroyed",
                       world_field});
    }
    return false;
  }
  if (entry.restoring) {
    refuse(request,
           {StatusCode::unavailable,
            "world " + name + " is being brought back; " + std::to_string(to_restore_) + " of " +
                std::to_string(kept_.size()) + " kept worlds are not up yet",
            world_field},
           retry_hint_s);
    return false;
  }
  if (world == nullptr) {
    refuse(request, base::not_found("no world " + name, world_field));
    return false;
  }
  if (!request.message->rewind_world().state().empty()) {
    refuse(request, base::invalid("is the server's own to fill in", "rewind_world.state"));
    return false;
  }
  switch (world->post(request)) {
    case Inbox::Post::taken:
      scheduler_.wake(entry.task);
      return true;
    case Inbox::Post::full:
      refuse(request,
             {StatusCode::unavailable, "world " + name + " has more requests than it can take at its next tick",
              world_field},
             retry_hint_s);
      return false;
    case Inbox::Post::closed:
      if (closed_) {
        refuse(request, going_down(), retry_hint_s);
        return false;
      }
      refuse(request, base::not_found("no world " + name + ": it was destroyed", world_field));
      return false;
  }
  return false;
}

bool WorldHost::ask_stream(std::uint32_t stream_id, Request request) {
  const auto world = registry_.find_stream(stream_id).world;
  const bool may_name = world != nullptr && request.session->grant().worlds.covers(world->name());
  if (may_name) return ask(world->name(), std::move(request));
  refuse(request, base::not_found("this session has no stream " + std::to_string(stream_id),
                                  std::string(kind_of(*request.message)) + ".stream_id"));
  return false;
}

void WorldHost::key_wanted(net::SessionId session, std::uint32_t stream_id) {
  const auto entry = registry_.find_stream(stream_id);
  if (entry.world == nullptr) return;
  if (entry.world->post(KeyWanted{session, stream_id}) == Inbox::Post::taken) scheduler_.wake(entry.task);
}

void WorldHost::stream_stalled(net::SessionId session, std::uint32_t stream_id) {
  const auto entry = registry_.find_stream(stream_id);
  if (entry.world == nullptr) return;
  if (entry.world->post(StreamStalled{session, stream_id}) == Inbox::Post::taken) scheduler_.wake(entry.task);
}

// The world's next tick acts on it.
void WorldHost::reader_report(net::SessionId session, const net::ReaderReport& report) {
  const auto world = registry_.find_stream(report.stream.stream_id).world;
  if (world != nullptr) (void)world->post(ReaderReported{session, report});
}

void WorldHost::session_ended(net::SessionId session, const std::string& name) {
  const auto entry = registry_.find(name);
  if (entry.world != nullptr && entry.world->post(SessionEnded{session}) == Inbox::Post::taken) {
    scheduler_.wake(entry.task);
  }
  snapshots_.drop(session);
  snapshots_.drop_old(steady_clock::now());
}

// Another world may have the name by now.
void WorldHost::end_owned(const std::shared_ptr<Session>& session, const std::string& name) {
  const auto entry = registry_.find(name);
  if (entry.world == nullptr || entry.world->owner() != session->id()) return;
  auto end = std::make_shared<v1::ClientMessage>();
  end->mutable_destroy_world()->set_world(name);
  if (entry.world->post(Request{session, std::move(end)}) == Inbox::Post::taken) scheduler_.wake(entry.task);
}

std::vector<WorldStatus> WorldHost::statuses() const {
  std::vector<WorldStatus> statuses;
  for (const auto& entry : registry_.all()) statuses.push_back(entry.world->status());
  for (const std::string& name : registry_.damaged()) {
    WorldStatus& status = statuses.emplace_back();
    status.listing.set_name(name);
    status.listing.set_damaged(true);
  }
  for (const std::string& name : registry_.restoring()) {
    WorldStatus& status = statuses.emplace_back();
    status.listing.set_name(name);
    status.listing.set_restoring(true);
  }
  std::ranges::sort(statuses, {}, [](const WorldStatus& status) { return status.listing.name(); });
  return statuses;
}

void WorldHost::refuse(const Request& request, const Status& why, double retry_after_s) {
  refuse(request, to_error(why, retry_after_s));
}

void WorldHost::refuse(const Request& request, const v1::Error& why) {
  v1::ServerMessage reply;
  reply.set_request_id(request.message->request_id());
  *reply.mutable_error() = why;
  metrics_.count_command(kind_of(*request.message), v1::Error::Code_Name(why.code()));
  server_.send(request.session->id(), serialise(reply));
}

void WorldHost::close() {
  if (closed_.exchange(true)) return;
  for (BackgroundQueue& restorer : restorers_) restorer.finish();
  builder_.finish();
  coarsener_.finish();
  small_coarsener_.finish();
  scheduler_.stop();
  disk_.flush();
  historian_.finish();
  filer_.finish();
  Outbox outbox;
  const TimePoint deadline = steady_clock::now() + config_.limits.drain_timeout;
  for (const auto& entry : registry_.all()) {
    HostedWorld& world = *entry.world;
    if (world.destroyed_by() != nullptr) continue;
    world.close(going_down(), outbox);
    world.finish_tick(deadline, outbox);  // past it, the last checkpoint and the log bring the world back
  }
  outbox.deliver(server_);
  disk_.flush();  // what was destroyed is answered when its files are gone
}

Status WorldHost::stop() {
  if (std::exchange(stopped_, true)) return {};
  close();
  for (const auto& entry : registry_.all()) {
    if (entry.world->destroyed_by() == nullptr) entry.world->checkpoint(steady_clock::now(), true);
  }
  disk_.finish();
  std::size_t not_kept = 0;
  Status first;
  for (const auto& entry : registry_.all()) {
    if (Status kept = entry.world->kept(); !kept.ok() && not_kept++ == 0)
      first = kept.inside("world " + entry.world->name());
  }
  if (not_kept <= 1) return first;
  return {first.code(), first.what() + " (and " + std::to_string(not_kept - 1) + " other worlds)", first.where()};
}

}  // namespace pneuma::app
