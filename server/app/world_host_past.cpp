// What is asked about a world's past: snapshots, branches, rewinds, and worlds that come from files. What is kept of a
// world is read by the thread that writes it, and replayed on another one.
#include <exception>
#include <utility>

#include <spdlog/spdlog.h>

#include "app/log.h"
#include "app/protocol.h"
#include "app/replay_log.h"
#include "app/request_fields.h"
#include "app/saved_world.h"
#include "app/world_file.h"
#include "app/world_host.h"
#include "base/limits.h"

namespace pneuma::app {

using base::Result;
using base::Status;
using base::StatusCode;
using std::chrono::steady_clock;

/// One of those that may be under way at a time.
struct WorldHost::LookBackPlace {
  LookBackPlace(WorldHost& counted_by, std::string of) : host(counted_by), client(std::move(of)) {}
  ~LookBackPlace() { host.give_back_place(client); }
  LookBackPlace(const LookBackPlace&) = delete;
  LookBackPlace& operator=(const LookBackPlace&) = delete;

  WorldHost& host;
  const std::string client;
};

/// A request under way.
struct WorldHost::LookBack {
  LookBack(Request asked, WorldMoment when, std::shared_ptr<HostedWorld> of, base::MemoryBudget::Share its_share,
           std::unique_ptr<LookBackPlace> its_place)
      : request(std::move(asked)),
        moment(std::move(when)),
        world(std::move(of)),
        share(std::move(its_share)),
        place(std::move(its_place)) {}

  [[nodiscard]] const v1::ClientMessage& message() const { return *request.message; }
  /// The tick that it asks for; none: the world as it is.
  [[nodiscard]] std::optional<std::uint64_t> tick() const {
    if (message().has_rewind_world()) return message().rewind_world().tick();
    if (message().branch_world().has_tick()) return message().branch_world().tick();
    return std::nullopt;
  }

  const Request request;
  const WorldMoment moment;
  const std::shared_ptr<HostedWorld> world;
  base::MemoryBudget::Share share;          // of the state
  base::MemoryBudget::Share history_share;  // and of what was read back
  std::optional<persist::History> history;
  Status failure;  // why there is no history, where one is needed
  std::unique_ptr<LookBackPlace> place;
};

Status WorldHost::look_back(const std::string& world, const Request& request,
                            const std::function<WorldMoment()>& moment) {
  const std::string kind(kind_of(*request.message));
  if (closed_) return {StatusCode::unavailable, "the server shuts down"};
  auto place = take_look_back_place(request.session->client());
  if (place == nullptr) {
    return {StatusCode::unavailable, "too many snapshots, branches and rewinds are under way", kind};
  }
  const auto entry = registry_.find(world);
  if (entry.world == nullptr) return base::not_found("no world " + world, kind + ".world");
  WorldMoment now = moment();
  auto share = memory_of(request.session->client()).take(now.world.live.snapshot.size());
  if (!share) return {StatusCode::unavailable, "there is no memory for it now", kind};
  const auto asked =
      std::make_shared<LookBack>(request, std::move(now), entry.world, std::move(*share), std::move(place));
  disk_.post([this, asked] {
    read_past(*asked);
    // A replay may take as long as what it repeats. What needs none does not wait for it.
    BackgroundQueue& queue = asked->tick() ? historian_ : filer_;
    queue.post([this, asked] { answer_look_back(*asked); }, asked->request.session->client());
  });
  return {};
}

std::unique_ptr<WorldHost::LookBackPlace> WorldHost::take_look_back_place(const std::string& client) {
  const std::lock_guard lock(clients_mutex_);
  std::size_t in_all = 0;
  for (const auto& [name, known] : clients_) in_all += known.looking_back;
  Client& own = client_of(client);
  if (in_all >= base::look_backs_max || own.looking_back >= base::client_look_backs_max) return nullptr;
  ++own.looking_back;
  return std::make_unique<LookBackPlace>(*this, client);
}

void WorldHost::give_back_place(const std::string& client) {
  const std::lock_guard lock(clients_mutex_);
  --client_of(client).looking_back;
}

void WorldHost::read_past(LookBack& asked) {
  const bool is_snapshot = asked.message().has_take_snapshot();
  if (!is_snapshot && !asked.tick()) return;
  if (!archive_ || !asked.moment.log_end) {
    asked.failure = {StatusCode::unavailable, "nothing of the world is kept now"};
    return;
  }
  persist::HistoryRange range;
  range.tick = asked.tick();
  range.sequence_min = asked.moment.first_checkpoint;
  range.until = *asked.moment.log_end;
  const std::size_t bytes_max = is_snapshot ? base::world_file_bytes_max : base::history_bytes_max;
  const base::MemoryBudget memory = memory_of(asked.request.session->client());
  const auto kept = archive_->history_bytes(asked.world->name(), range);
  auto share = memory.take(std::min({bytes_max, kept.ok() ? *kept : bytes_max, memory.bytes_left()}));
  if (!share) share.emplace();
  range.bytes_max = share->bytes();
  auto history = archive_->read_history(asked.world->name(), range);
  if (!history.ok()) {
    asked.failure = history.status();
    return;
  }
  std::size_t bytes = history->begin.bytes.size();
  for (const persist::LogRecord& record : history->records) bytes += sizeof(record) + record.bytes.size();
  share->shrink_to(bytes);
  asked.history_share = std::move(*share);
  asked.history = std::move(*history);
}

void WorldHost::answer_look_back(LookBack& asked) {
  Status failed;
  try {
    if (closed_) {
      failed = {StatusCode::unavailable, "the server shuts down"};
    } else if (asked.message().has_take_snapshot()) {
      failed = take_snapshot(asked);
    } else {
      failed = asked.message().has_branch_world() ? branch(asked) : rewind(asked);
    }
  } catch (const std::exception& error) {
    spdlog::error("world={} session={} {} threw: {}", log_name(asked.world->name()), asked.request.session->id(),
                  kind_of(asked.message()), error.what());
    failed = {StatusCode::internal, "the server failed at this request"};
  }
  if (!failed.ok()) refuse(asked.request, failed, failed.code() == StatusCode::unavailable ? retry_hint_s : 0.0);
}

Status WorldHost::take_snapshot(LookBack& asked) {
  const v1::WorldFile file = make_world_file(asked.world->name(), asked.moment, asked.history);
  auto bytes = to_bytes(file);
  if (!bytes.ok()) return bytes.status().inside("take_snapshot");
  v1::Snapshot head;
  head.set_tick(file.tick());
  head.set_state_hash(file.state_hash());
  if (!file.earlier_state().empty()) head.set_history_from_tick(file.earlier_tick());
  auto piece = snapshots_.put(asked.request.session->id(), asked.request.session->client(), std::move(head),
                              std::move(*bytes), steady_clock::now());
  if (!piece.ok()) return piece.status();
  v1::ServerMessage reply;
  reply.set_request_id(asked.message().request_id());
  *reply.mutable_snapshot() = std::move(*piece);
  metrics_.count_command("take_snapshot", "ok");
  server_.send(asked.request.session->id(), serialise(reply));
  return {};
}

void WorldHost::read_snapshot(Request request) {
  auto piece = snapshots_.read(request.session->id(), request.message->read_snapshot(), steady_clock::now());
  if (!piece.ok()) return refuse(request, piece.status());
  v1::ServerMessage reply;
  reply.set_request_id(request.message->request_id());
  *reply.mutable_snapshot() = std::move(*piece);
  metrics_.count_command("read_snapshot", "ok");
  server_.send(request.session->id(), serialise(reply));
}

Result<LiveWorld> WorldHost::replay_to(const LookBack& asked, std::uint64_t tick, bool& paused,
                                       WorldMemory& memory) const {
  const std::string kind(kind_of(asked.message()));
  if (!asked.history) return asked.failure.where().empty() ? asked.failure.inside(kind + ".tick") : asked.failure;
  const auto saved = from_bytes(asked.history->begin.bytes);
  if (!saved.ok()) return saved.status().inside(kind);
  auto live = LiveWorld::restore(saved->live, [&memory](const v1::Scene& source, const physics::Scene& scene) {
    return memory.admit(source, scene);
  });
  if (!live.ok()) return live.status().inside(kind);
  memory.settle(true, live->physics().integrator(), 0.0);
  paused = saved->paused;
  const auto take_over = [&memory](const v1::Scene& source, const physics::Scene& scene) {
    memory.take_over(source, scene);
    return Status();
  };
  const ReplayOptions options{tick, &closed_};
  if (Status ended = replay_log(asked.world->name(), asked.history->records, *live, paused, take_over, options);
      !ended.ok()) {
    return ended.inside(kind);
  }
  memory.settle(true, live->physics().integrator(), 0.0);
  return live;
}

Status WorldHost::branch(LookBack& asked) {
  const v1::BranchWorld& wanted = asked.message().branch_world();
  WorldRoom room = room_of(asked.request.session->client());
  bool paused = asked.moment.world.paused;
  Result<LiveWorld> live =
      wanted.has_tick()
          ? replay_to(asked, wanted.tick(), paused, room.memory)
          : LiveWorld::restore(asked.moment.world.live, [&room](const v1::Scene& source, const physics::Scene& scene) {
              return room.memory.admit(source, scene);
            });
  if (!live.ok()) return live.status();
  room.memory.settle(true, live->physics().integrator(), 0.0);
  return adopt(asked.request, wanted.name(), asked.world->name(), std::move(*live), paused || wanted.paused(),
               std::move(room));
}

// The state goes to the world as a request of its own, which is logged with it: so a replay needs no older files.
Status WorldHost::rewind(LookBack& asked) {
  const std::uint64_t tick = asked.message().rewind_world().tick();
  WorldMemory memory({memory_, config_.memory.world_bytes_max});
  bool paused = false;
  const auto live = replay_to(asked, tick, paused, memory);
  if (!live.ok()) return live.status();
  auto message = std::make_shared<v1::ClientMessage>(asked.message());
  message->mutable_rewind_world()->set_state(to_bytes(SavedWorld{live->save(), paused}));
  Request with_state = asked.request;
  with_state.bytes = message->SpaceUsedLong();
  with_state.message = std::move(message);
  const auto posted = asked.world->post(std::move(with_state));
  if (posted == Inbox::Post::full) return {StatusCode::unavailable, "the world has too many requests", "rewind_world"};
  if (posted == Inbox::Post::closed) return base::not_found("the world was destroyed", "rewind_world.world");
  const auto entry = registry_.find(asked.world->name());
  if (entry.world == asked.world) scheduler_.wake(entry.task);
  return {};
}

Status WorldHost::restore_file(const Request& request) {
  const v1::RestoreWorld& asked = request.message->restore_world();
  const auto file = read_world_file(asked.snapshot());
  if (!file.ok()) return file.status().inside("restore_world.snapshot");
  WorldRoom room = room_of(request.session->client());
  auto opened = open_world(*file, [&room](const v1::Scene& source, const physics::Scene& scene) {
    return room.memory.admit(source, scene);
  });
  if (!opened.ok()) return opened.status().inside("restore_world.snapshot");
  room.memory.settle(true, opened->live.physics().integrator(), 0.0);
  return adopt(request, asked.name(), to_world_name(file->world()), std::move(opened->live),
               opened->paused || asked.paused(), std::move(room));
}

Status WorldHost::adopt(const Request& request, const std::string& asked_name, const std::string& otherwise,
                        LiveWorld live, bool paused, WorldRoom room) {
  const std::string kind(kind_of(*request.message));
  const auto name = reserve(request, asked_name, otherwise);
  if (!name) return {};  // and answered
  const std::uint64_t tick = live.tick();
  const bool owned = request.message->restore_world().owned() || request.message->branch_world().owned();
  const auto owner = owned ? std::optional(request.session->id()) : std::nullopt;
  try {
    if (Status failed = keep_and_host(*name, std::move(live), paused, std::move(room), owner); !failed.ok()) {
      return failed.inside(kind);
    }
  } catch (...) {
    registry_.erase(*name);
    throw;
  }
  metrics_.count_command(kind, "ok");
  spdlog::info("world={} session={} tick={} {}", log_name(*name), request.session->id(), tick, kind);
  server_.send(request.session->id(), serialise(done_reply(request.message->request_id(), tick, *name)));
  if (owned && !request.session->own(*name)) end_owned(request.session, *name);
  return {};
}

}  // namespace pneuma::app
