// FrameHub's readers of adaptive quality: what they report, and their way between the classes.
#include <algorithm>
#include <utility>

#include <google/protobuf/util/message_differencer.h>

#include "app/frame_hub.h"
#include "base/limits.h"
#include "base/number_text.h"

namespace pneuma::app {

namespace {

bool is_same(const v1::TouchWish& a, const v1::TouchWish& b) {
  return google::protobuf::util::MessageDifferencer::Equals(a, b);
}

}  // namespace

void FrameHub::set_wishes(Classes::value_type& entry, net::SessionId session, const v1::Subscribe& request,
                          const Quality& asked) {
  Subscriber& subscriber = entry.second.subscribers.at(session);
  subscriber.wants_commands = request.commands();
  if (!request.has_touches()) {
    subscriber.touches.reset();
  } else if (!subscriber.touches || !is_same(subscriber.touches->wish(), request.touches())) {
    subscriber.touches.emplace(request.touches());
  }
  subscriber.key_interval_s = request.key_interval_s();
  std::optional<Adaptive>& adaptive = subscriber.adaptive;
  if (request.adaptive()) {
    if (!adaptive || adaptive->asked != asked) adaptive = Adaptive{request.world(), asked};
    if (std::exchange(adaptive->ends, false)) adaptive->to_rung.reset();
  } else if (entry.first == asked) {
    adaptive.reset();
  } else {
    adaptive->to_rung = 0;
    adaptive->ends = true;
  }
}

void FrameHub::reader_report(net::SessionId session, const net::ReaderReport& report) {
  for (auto& [quality, quality_class] : classes_) {
    const auto found = quality_class.subscribers.find(session);
    if (quality_class.stream_id != report.stream.stream_id || found == quality_class.subscribers.end()) continue;
    std::optional<Adaptive>& adaptive = found->second.adaptive;
    if (!adaptive || adaptive->ends) continue;
    if (const auto rung = adaptive->ladder.advise(report)) adaptive->to_rung = rung;
  }
}

std::optional<FrameHub::Quality> FrameHub::on_rung(const Quality& asked, std::size_t rung) const {
  Quality quality = asked;
  // Of the whole bound that the client was told, the source's own part included.
  const double factor = quality_rungs[rung].error_factor;
  quality.max_error_m = factor * asked.max_error_m + (factor - 1.0) * source_error_m_;
  quality.rate_factor *= quality_rungs[rung].rate_divisor;
  if (quality.max_error_m > base::max_error_max_m) return std::nullopt;
  return quality;
}

void FrameHub::move_readers(std::uint64_t tick, double world_rate_hz, Outbox& outbox) {
  struct Move {
    Quality from;
    net::SessionId session;
    std::size_t rung;
  };
  std::vector<Move> moves;
  for (auto& [quality, quality_class] : classes_) {
    for (auto& [session, subscriber] : quality_class.subscribers) {
      if (!subscriber.adaptive) continue;
      if (const auto rung = std::exchange(subscriber.adaptive->to_rung, std::nullopt)) {
        moves.push_back({quality, session, *rung});
      }
    }
  }
  for (const Move& move : moves) {
    const auto from = classes_.find(move.from);
    Adaptive& adaptive = *from->second.subscribers.at(move.session).adaptive;
    // Where that one cannot be had, a coarser one may; a finer one waits for its next try.
    const std::size_t last = move.rung > adaptive.ladder.rung() ? quality_rungs.size() - 1 : move.rung;
    bool moved = false;
    for (std::size_t rung = move.rung; rung <= last && !moved; ++rung) {
      moved = move_reader(from, move.session, rung, tick, world_rate_hz, outbox);
    }
    if (!moved && adaptive.ends) adaptive.to_rung = move.rung;  // until there is room
  }
}

// False, and nothing is changed, where there is no such quality, no room for another one, or the session has a stream
// of it already.
bool FrameHub::move_reader(Classes::iterator from, net::SessionId session, std::size_t rung, std::uint64_t tick,
                           double world_rate_hz, Outbox& outbox) {
  const Subscriber& before = from->second.subscribers.at(session);
  const auto quality = on_rung(before.adaptive->asked, rung);
  if (!quality) return false;
  const auto there = classes_.find(*quality);
  const bool leaves_room = from->second.subscribers.size() == 1;
  if (there == classes_.end() && classes_.size() >= base::world_quality_classes_max && !leaves_room) return false;
  if (there != classes_.end() && there->second.subscribers.contains(session)) return false;

  Subscriber subscriber{before.session};
  subscriber.wants_commands = before.wants_commands;
  subscriber.touches = before.touches;
  subscriber.key_interval_s = before.key_interval_s;
  if (!before.adaptive->ends) {
    Adaptive& adaptive = subscriber.adaptive.emplace(*before.adaptive);
    adaptive.reported_on = false;
    adaptive.ladder.moved(rung);
  }
  const std::string world = before.adaptive->world;
  const std::uint32_t ended = from->second.stream_id;
  leave(from, session);
  const auto to = class_of(*quality, world_rate_hz);
  to->second.subscribers.emplace(session, std::move(subscriber));
  to->second.sessions.reset();

  v1::ServerMessage message = event_message(v1::Event::STREAM_REPLACED, world, tick);
  v1::Event& event = *message.mutable_event();
  event.set_stream_id(ended);
  *event.mutable_successor() = describe(*to, world, world_rate_hz);
  event.set_detail("within " + base::number_text(event.successor().max_error_m()) + " m, " +
                   base::number_text(event.successor().rate_hz()) + " frames a second");
  outbox.end_stream(session, ended);
  outbox.send(session, message);
  return true;
}

}  // namespace pneuma::app
