#include "app/frame_hub.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <utility>

#include "app/stream_terms.h"
#include "base/limits.h"
#include "base/number_text.h"

namespace pneuma::app {

namespace {

View view_of(const v1::Subscribe& request) {
  View view{{request.bodies().begin(), request.bodies().end()}, request.level_of_detail()};
  std::ranges::sort(view.bodies);
  const auto repeated = std::ranges::unique(view.bodies);
  view.bodies.erase(repeated.begin(), repeated.end());
  return view;
}

/// A velocity that is carried on for the time between two frames puts a vertex no further off than the frame does.
double max_velocity_error_m_s(double max_error_m, double rate_hz) {
  if (max_error_m == 0.0) return 0.0;  // of plain frames: as near as a float is
  return std::clamp(max_error_m * rate_hz, base::max_error_min_m, base::max_error_max_m);
}

}  // namespace

FrameHub::FrameHub(std::function<std::uint32_t()> take_stream_id, std::function<void(std::uint32_t)> drop_stream_id,
                   MeshTopologies::Defer defer)
    : take_stream_id_(std::move(take_stream_id)),
      drop_stream_id_(std::move(drop_stream_id)),
      topologies_(std::move(defer)) {}

base::Result<v1::Subscribed> FrameHub::subscribe(const std::shared_ptr<Session>& session, const v1::Subscribe& request,
                                                 double world_rate_hz, const Admit& admit) {
  if (base::Status wrong = check_terms(request); !wrong.ok()) return wrong;
  const bool plain = request.encoding() == v1::Subscribe::PLAIN;
  // Of plain frames 0 is as near as a float is.
  const double max_error_m = request.max_error_m() == 0.0 && !plain ? base::max_error_default_m : request.max_error_m();
  Quality quality{request.rate_hz(),
                  1,
                  max_error_m,
                  view_of(request),
                  request.velocities(),
                  request.scalars(),
                  request.contacts(),
                  request.time_layers(),
                  request.simulated() && !request.time_layers() && !plain && request.level_of_detail() == 0,
                  plain};

  auto found = find_asked(session->id(), quality, world_rate_hz);
  if (found != classes_.end()) {
    const auto& adaptive = found->second.subscribers.at(session->id()).adaptive;
    quality = adaptive ? adaptive->asked : found->first;
  } else {
    // Who asks for the same frames in other words shares them.
    const auto like =
        std::ranges::find_if(classes_, [&](const auto& entry) { return entry.first.is_like(quality, world_rate_hz); });
    if (like != classes_.end()) quality = like->first;
    const auto same = classes_.find(quality);
    if (same != classes_.end() && same->second.subscribers.contains(session->id())) {
      return base::Status(
          base::StatusCode::failed_precondition,
          "the session's adaptive stream " + std::to_string(same->second.stream_id) + " is of this quality for now",
          "subscribe");
    }
    if (streams_of(session->id()) >= base::session_streams_per_world_max) {
      return base::Status(
          base::StatusCode::limit_exceeded,
          "a session has at most " + std::to_string(base::session_streams_per_world_max) + " streams of a world",
          "subscribe");
    }
    const bool is_new = !classes_.contains(quality);
    if (is_new && classes_of_client(session->client()) >= base::client_quality_classes_max) {
      return base::Status(base::StatusCode::limit_exceeded,
                          "the client has " + std::to_string(base::client_quality_classes_max) +
                              " qualities (of rate, error, layers and contents) of the world to itself already",
                          "subscribe");
    }
    if (is_new && classes_.size() >= base::world_quality_classes_max) {
      return base::Status(base::StatusCode::limit_exceeded,
                          "the world has its " + std::to_string(base::world_quality_classes_max) +
                              " qualities (of rate, error, layers and contents) already",
                          "subscribe");
    }
    if (is_new) {
      if (base::Status no_room = admit(quality.bytes_per_vertex()); !no_room.ok()) return no_room.inside("subscribe");
    }
    found = class_of(quality, world_rate_hz);
    found->second.subscribers.try_emplace(session->id(), Subscriber{session});
    found->second.sessions.reset();
  }
  for (const std::string& hash : request.known_topologies()) session->knows_topology(hash);
  set_wishes(*found, session->id(), request, quality);
  return describe(*found, request.world(), world_rate_hz);
}

std::uint64_t FrameHub::Quality::divisor(double world_rate_hz) const {
  const double divisions = rate_hz == 0.0 ? 1.0 : std::round(world_rate_hz / rate_hz);
  constexpr auto most = static_cast<double>(rate_divisor_max);
  return static_cast<std::uint64_t>(std::clamp(std::max(divisions, 1.0) * static_cast<double>(rate_factor), 1.0, most));
}

bool FrameHub::Quality::is_like(const Quality& other, double world_rate_hz) const {
  if (divisor(world_rate_hz) != other.divisor(world_rate_hz) || rate_factor != other.rate_factor) return false;
  Quality same = *this;
  same.rate_hz = other.rate_hz;
  return same == other;
}

double FrameHub::bytes_per_vertex() const {
  double sum = 0.0;
  for (const auto& [quality, quality_class] : classes_) sum += quality.bytes_per_vertex();
  return sum;
}

v1::Subscribed FrameHub::describe(const Classes::value_type& entry, const std::string& world,
                                  double world_rate_hz) const {
  const auto& [quality, quality_class] = entry;
  v1::Subscribed subscribed;
  subscribed.set_stream_id(quality_class.stream_id);
  subscribed.set_world(world);
  subscribed.set_rate_hz(world_rate_hz / static_cast<double>(quality_class.rate_divisor));
  subscribed.set_max_error_m(source_error_m_ + quality.max_error_m);
  subscribed.set_tick_s(quality_class.encoder.contents().tick_s);
  if (!quality.plain) subscribed.set_grid_step_m(codec::grid_step_m(quality.max_error_m));
  if (quality.velocities) {
    const double max_error_m_s = quality_class.encoder.contents().max_velocity_error_m_s;
    subscribed.set_max_velocity_error_m_s(source_velocity_error_m_s_ + max_error_m_s);
    if (!quality.plain) subscribed.set_velocity_grid_step_m_s(codec::grid_step_m(max_error_m_s));
  }
  return subscribed;
}

// The session's stream for what it asks: of that quality, or where an adaptive one has taken it from there. One that
// was only taken to that quality is for something else.
FrameHub::Classes::iterator FrameHub::find_asked(net::SessionId session, const Quality& asked, double world_rate_hz) {
  return std::ranges::find_if(classes_, [&](const auto& entry) {
    const auto subscriber = entry.second.subscribers.find(session);
    if (subscriber == entry.second.subscribers.end()) return false;
    const std::optional<Adaptive>& adaptive = subscriber->second.adaptive;
    return (adaptive ? adaptive->asked : entry.first).is_like(asked, world_rate_hz);
  });
}

FrameHub::Classes::iterator FrameHub::class_of(const Quality& quality, double world_rate_hz) {
  const auto found = classes_.find(quality);
  if (found != classes_.end()) return found;
  const std::uint32_t stream_id = take_stream_id_();
  const std::uint64_t rate_divisor = quality.divisor(world_rate_hz);
  const double rate_hz = world_rate_hz / static_cast<double>(rate_divisor);
  const FrameContents contents{
      .max_error_m = quality.max_error_m,
      .tick_s = 1.0 / world_rate_hz,
      .max_velocity_error_m_s = quality.velocities ? max_velocity_error_m_s(quality.max_error_m, rate_hz) : 0.0,
      .velocities = quality.velocities,
      .scalars = quality.scalars,
      .contacts = quality.contacts,
      .plain = quality.plain};
  QualityClass made{
      stream_id,
      rate_divisor,
      LayeredEncoder(FrameEncoder(stream_id, contents)),
      WorldLayout(quality.view, {.ticks = quality.simulated ? rate_divisor : 0,
                                 .grid_step_m = quality.simulated ? codec::grid_step_m(quality.max_error_m) : 0.0}),
      {},
      {},
      0.0};
  return classes_.emplace(quality, std::move(made)).first;
}

FrameHub::Classes::iterator FrameHub::leave(Classes::iterator from, net::SessionId session) {
  from->second.subscribers.erase(session);
  from->second.sessions.reset();
  if (!from->second.subscribers.empty()) return std::next(from);
  drop_stream_id_(from->second.stream_id);
  return classes_.erase(from);
}

bool FrameHub::unsubscribe(net::SessionId session, std::uint32_t stream_id, Outbox& outbox) {
  for (auto it = classes_.begin(); it != classes_.end(); ++it) {
    if (it->second.stream_id != stream_id || !it->second.subscribers.contains(session)) continue;
    outbox.end_stream(session, stream_id);
    leave(it, session);
    return true;
  }
  return false;
}

void FrameHub::session_ended(net::SessionId session) {
  for (auto it = classes_.begin(); it != classes_.end();) {
    it = it->second.subscribers.contains(session) ? leave(it, session) : std::next(it);
  }
}

void FrameHub::key_wanted(net::SessionId session, std::uint32_t stream_id) {
  if (Subscriber* subscriber = find(session, stream_id)) {
    subscriber->wants_key = true;
    subscriber->is_stalled = false;
  }
}

void FrameHub::stream_stalled(net::SessionId session, std::uint32_t stream_id) {
  if (Subscriber* subscriber = find(session, stream_id)) subscriber->is_stalled = true;
}

bool FrameHub::request_key(net::SessionId session, std::uint32_t stream_id) {
  Subscriber* subscriber = find(session, stream_id);
  if (subscriber != nullptr) subscriber->wants_key = subscriber->takes_no_delta = true;
  return subscriber != nullptr;
}

FrameHub::Subscriber* FrameHub::find(net::SessionId session, std::uint32_t stream_id) {
  for (auto& [quality, quality_class] : classes_) {
    const auto found = quality_class.subscribers.find(session);
    if (quality_class.stream_id == stream_id && found != quality_class.subscribers.end()) return &found->second;
  }
  return nullptr;
}

void FrameHub::close(Outbox& outbox) {
  for (const auto& [quality, quality_class] : classes_) {
    for (const auto& [session, subscriber] : quality_class.subscribers) {
      outbox.end_stream(session, quality_class.stream_id);
    }
    drop_stream_id_(quality_class.stream_id);
  }
  classes_.clear();
}

void FrameHub::rate_changed(const std::string& world, std::uint64_t tick, double world_rate_hz, Outbox& outbox) {
  for (auto& [quality, quality_class] : classes_) {
    v1::ServerMessage message = event_message(v1::Event::STREAM_RATE_CHANGED, world, tick);
    quality_class.rate_divisor = quality.divisor(world_rate_hz);
    if (quality.simulated) quality_class.layout.set_frame_ticks(quality_class.rate_divisor);
    const double rate_hz = world_rate_hz / static_cast<double>(quality_class.rate_divisor);
    message.mutable_event()->set_stream_id(quality_class.stream_id);
    message.mutable_event()->set_rate_hz(rate_hz);
    message.mutable_event()->set_detail(base::number_text(rate_hz) + " frames a second");
    const net::SharedBytes bytes = serialise(message);
    for (const auto& [session, subscriber] : quality_class.subscribers) outbox.send(session, bytes);
  }
}

// What of a change it then misses comes with its next frame, which is for everyone.
bool FrameHub::leave_out_untaken(QualityClass& quality_class) {
  if (quality_class.is_taken()) return false;
  quality_class.was_left_out = true;
  return true;
}

void FrameHub::encode_tick(const FrameSource& source, std::uint64_t tick, bool all, Outbox& outbox) {
  if (classes_.empty()) return;
  move_readers(tick, 1.0 / source.tick_period_s(), outbox);
  const auto updates = update_layouts(source, tick);
  MeasuredScalars scalars(source);
  auto update = updates.begin();
  for (auto& [quality, quality_class] : classes_) {
    const WorldLayout::Update came = *update++;
    if (came == WorldLayout::Update::waits || leave_out_untaken(quality_class)) continue;
    introduce(quality_class, outbox);
    const bool due = tick % quality_class.rate_divisor == 0;
    const bool is_back = std::exchange(quality_class.was_left_out, false);
    const bool out_of_turn =
        all || is_back || came == WorldLayout::Update::changed || !quality_class.encoder.key_tick();
    if (due || out_of_turn) {
      // What comes out of its turn is for everyone, and so is what can build on nothing: of a recording, the same tick
      // once more or an earlier one.
      const bool builds = came == WorldLayout::Update::none && quality_class.encoder.key_tick() < tick;
      const bool layered = quality.time_layers && !out_of_turn && builds;
      publish_new(quality, quality_class, source, scalars, tick,
                  layered ? LayeredEncoder::layer_of(tick / quality_class.rate_divisor) : 0, outbox);
    } else {
      publish_last(quality_class, outbox);
    }
  }
}

void FrameHub::encode_rest(const FrameSource& source, std::uint64_t tick, Outbox& outbox) {
  if (classes_.empty()) return;
  move_readers(tick, 1.0 / source.tick_period_s(), outbox);
  const auto updates = update_layouts(source, tick);
  MeasuredScalars scalars(source);
  auto update = updates.begin();
  for (auto& [quality, quality_class] : classes_) {
    const WorldLayout::Update came = *update++;
    if (came == WorldLayout::Update::waits || leave_out_untaken(quality_class)) continue;
    introduce(quality_class, outbox);
    const bool is_back = std::exchange(quality_class.was_left_out, false);
    // Where the last frame was of a higher layer, readers who shed it would not see where the world came to rest.
    if (is_back || came != WorldLayout::Update::none || quality_class.encoder.key_tick() != tick) {
      publish_new(quality, quality_class, source, scalars, tick, 0, outbox);
    } else {
      publish_last(quality_class, outbox);
    }
  }
}

void FrameHub::edited() {
  for (auto& [quality, quality_class] : classes_) {
    quality_class.layout.edited();
    for (auto& [session, subscriber] : quality_class.subscribers) {
      if (subscriber.touches) subscriber.touches->edited();
    }
  }
}

void FrameHub::mechanics_changed() {
  for (auto& [quality, quality_class] : classes_) quality_class.layout.mechanics_changed();
}

std::vector<WorldLayout::Update> FrameHub::update_layouts(const FrameSource& source, std::uint64_t tick) {
  std::vector<WorldLayout::Update> updates;
  bool any = false;
  for (auto& [quality, quality_class] : classes_) {
    updates.push_back(quality_class.layout.update(source, topologies_, tick));
    any = any || updates.back() != WorldLayout::Update::none;
  }
  if (any) topologies_.drop_unused();
  return updates;
}

// Topologies and the layout go before the first frame that needs them.
void FrameHub::introduce(QualityClass& quality_class, Outbox& outbox) {
  net::SharedBytes layout;
  for (auto& [id, subscriber] : quality_class.subscribers) {
    if (subscriber.adaptive && !std::exchange(subscriber.adaptive->reported_on, true)) {
      outbox.report_on(id, quality_class.stream_id);
    }
    const WorldLayout& now = quality_class.layout;
    if (subscriber.layout_id == now.id()) continue;
    for (const TopologyMessagePtr& topology : now.topologies()) outbox.send_topology(subscriber.session, *topology);
    if (layout == nullptr) layout = serialise(now.message(quality_class.stream_id));
    outbox.send(id, layout);
    subscriber.layout_id = now.id();
  }
}

// Whose next frame that can be a key would come later than its key interval after its last key: they get a key now.
std::vector<net::SessionId> FrameHub::take_due_keys(QualityClass& quality_class, std::uint64_t ticks_between,
                                                    std::uint64_t tick, double tick_period_s) {
  std::vector<net::SessionId> due;
  for (auto& [id, subscriber] : quality_class.subscribers) {
    if (std::exchange(subscriber.takes_no_delta, false)) {
      due.push_back(id);
      continue;
    }
    if (subscriber.key_interval_s == 0.0) continue;
    const bool went_back = tick < subscriber.last_key_tick;  // a recording, by a seek
    const auto ticks_until_next = static_cast<double>(tick + ticks_between - subscriber.last_key_tick);
    // A little more than none: an interval of 1 s at 60 Hz is 60 ticks, whatever a sixtieth is in binary.
    constexpr double rounding = 1e-9;
    if (!went_back && ticks_until_next * tick_period_s <= subscriber.key_interval_s * (1.0 + rounding)) continue;
    subscriber.last_key_tick = tick;
    due.push_back(id);
  }
  return due;
}

void FrameHub::publish_new(const Quality& quality, QualityClass& quality_class, const FrameSource& source,
                           MeasuredScalars& scalars, std::uint64_t tick, std::uint32_t layer, Outbox& outbox) {
  bool with_key = false;
  std::vector<net::SessionId> keyed;
  if (layer > 0) {
    publish_last(quality_class, outbox);
  } else {
    for (auto& [id, subscriber] : quality_class.subscribers) {
      if (!std::exchange(subscriber.wants_key, false)) continue;
      subscriber.last_key_tick = tick;
      with_key = true;
    }
    const std::uint64_t ticks_between = quality_class.rate_divisor * (quality.time_layers ? LayeredEncoder::cycle : 1);
    keyed = take_due_keys(quality_class, ticks_between, tick, source.tick_period_s());
  }
  if (quality_class.sessions == nullptr) {
    auto sessions = std::make_shared<std::vector<net::SessionId>>();
    for (const auto& [id, subscriber] : quality_class.subscribers) sessions->push_back(id);
    quality_class.sessions = std::move(sessions);
  }
  const auto start = std::chrono::steady_clock::now();
  net::StreamFrame frame =
      quality_class.encoder.encode(source, scalars, tick, quality_class.layout, layer, with_key || !keyed.empty());
  quality_class.encode_time_us =
      std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
  if (keyed.empty()) return publish(quality_class.sessions, std::move(frame), outbox);
  // A session takes the delta where it can, so those whose key is due are not offered it.
  net::StreamFrame key = frame;
  key.delta = nullptr;
  publish(std::make_shared<const std::vector<net::SessionId>>(keyed), std::move(key), outbox);
  auto others = std::make_shared<std::vector<net::SessionId>>();
  std::ranges::set_difference(*quality_class.sessions, keyed, std::back_inserter(*others));  // both ascend
  if (!others->empty()) publish(std::move(others), std::move(frame), outbox);
}

void FrameHub::publish(SessionIds sessions, net::StreamFrame frame, Outbox& outbox) {
  const net::SharedBytes& message = frame.delta ? frame.delta : frame.key;
  frame_bytes_.add(std::chrono::steady_clock::now(), sessions->size() * message->size());
  outbox.publish(std::move(sessions), std::move(frame));
}

void FrameHub::publish_last(QualityClass& quality_class, Outbox& outbox) {
  auto waiting = std::make_shared<std::vector<net::SessionId>>();
  for (auto& [id, subscriber] : quality_class.subscribers) {
    if (!std::exchange(subscriber.wants_key, false)) continue;
    subscriber.takes_no_delta = false;
    subscriber.last_key_tick = *quality_class.encoder.key_tick();
    waiting->push_back(id);
  }
  if (waiting->empty()) return;
  for (net::StreamFrame& frame : quality_class.encoder.for_joiners()) publish(waiting, std::move(frame), outbox);
}

void FrameHub::applied(const Change& change, Outbox& outbox) const {
  for (const auto& [quality, quality_class] : classes_) {
    net::SharedBytes bytes;
    for (const auto& [session, subscriber] : quality_class.subscribers) {
      if (!subscriber.wants_commands) continue;
      if (bytes == nullptr) {
        v1::ServerMessage message;
        message.mutable_applied()->set_stream_id(quality_class.stream_id);
        message.mutable_applied()->set_tick(change.tick);
        message.mutable_applied()->set_grab_id(change.grab_id);
        message.mutable_applied()->set_session_id(change.session);
        *message.mutable_applied()->mutable_command() = change.command;
        message.mutable_applied()->mutable_command()->clear_request_id();
        bytes = serialise(message);
      }
      outbox.send(session, bytes);
    }
  }
}

void FrameHub::forget_touches() {
  for (auto& [quality, quality_class] : classes_) {
    for (auto& [session, subscriber] : quality_class.subscribers) {
      if (subscriber.touches) subscriber.touches->forget();
    }
  }
}

void FrameHub::tell_touches(const TickTouches& touches, std::uint64_t tick, Outbox& outbox) {
  for (auto& [quality, quality_class] : classes_) {
    for (auto& [session, subscriber] : quality_class.subscribers) {
      if (!subscriber.touches) continue;
      std::optional<v1::Touches> news = subscriber.touches->tell(touches);
      if (!news) continue;
      news->set_stream_id(quality_class.stream_id);
      news->set_tick(tick);
      v1::ServerMessage message;
      *message.mutable_touches() = std::move(*news);
      outbox.send(session, message);
    }
  }
}

void FrameHub::send_to_all(const v1::ServerMessage& message, Outbox& outbox) const {
  std::set<net::SessionId> sessions;
  for (const auto& [quality, quality_class] : classes_) {
    for (const auto& [id, subscriber] : quality_class.subscribers) sessions.insert(id);
  }
  const net::SharedBytes bytes = serialise(message);
  for (const net::SessionId session : sessions) outbox.send(session, bytes);
}

void FrameHub::describe_streams(net::SessionId session, const net::ReaderStats& reader, double world_rate_hz,
                                v1::Stats& out) const {
  for (const auto& [quality, quality_class] : classes_) {
    if (!quality_class.subscribers.contains(session)) continue;
    v1::Stats::Stream& stream = *out.add_streams();
    stream.set_stream_id(quality_class.stream_id);
    stream.set_rate_hz(world_rate_hz / static_cast<double>(quality_class.rate_divisor));
    stream.set_max_error_m(source_error_m_ + quality.max_error_m);
    stream.set_encode_time_us(quality_class.encode_time_us);
    stream.set_drain_bytes_s(reader.drain_bytes_s);
    const auto read = std::ranges::find(reader.streams, quality_class.stream_id, &net::StreamStats::stream_id);
    if (read == reader.streams.end()) continue;  // no frame of it was made yet
    const net::FrameTotals& totals = read->totals;
    stream.set_frames_sent(totals.frames_sent);
    stream.set_frames_dropped(totals.frames_dropped);
    if (totals.vertices_sent > 0) {
      stream.set_bits_per_vertex(8.0 * static_cast<double>(totals.bytes_sent) /
                                 static_cast<double>(totals.vertices_sent));
    }
    stream.set_queue_age_ms(std::chrono::duration<double, std::milli>(read->queue_age).count());
  }
}

std::size_t FrameHub::streams_of(net::SessionId session) const {
  return static_cast<std::size_t>(std::count_if(
      classes_.begin(), classes_.end(), [&](const auto& entry) { return entry.second.subscribers.contains(session); }));
}

std::size_t FrameHub::classes_of_client(const std::string& client) const {
  const auto is_of_client = [&](const auto& entry) { return entry.second.session->client() == client; };
  return static_cast<std::size_t>(std::ranges::count_if(
      classes_, [&](const auto& entry) { return std::ranges::all_of(entry.second.subscribers, is_of_client); }));
}

bool FrameHub::wants_touches() const {
  const auto wishes = [](const auto& subscriber) { return subscriber.second.touches.has_value(); };
  return std::ranges::any_of(classes_,
                             [&](const auto& entry) { return std::ranges::any_of(entry.second.subscribers, wishes); });
}

bool FrameHub::wants_contacts() const {
  return std::ranges::any_of(classes_, [](const auto& entry) { return entry.first.contacts; });
}

std::size_t FrameHub::subscriber_count() const {
  std::size_t count = 0;
  for (const auto& [quality, quality_class] : classes_) count += quality_class.subscribers.size();
  return count;
}

}  // namespace pneuma::app
