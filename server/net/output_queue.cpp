#include "net/output_queue.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "net/framing.h"

namespace pneuma::net {

bool OutputQueue::push_reply(SharedBytes message) {
  // One reply may be larger than the limit, as a scene or a large edit is that others made: what counts is what waits
  // beside it.
  if (reply_bytes_ >= bytes_max_ && reply_bytes_ - largest_reply_bytes() >= bytes_max_) return false;
  push_goodbye(std::move(message));
  return true;
}

void OutputQueue::push_goodbye(SharedBytes message) {
  Entry entry{.message = std::move(message), .stream_id = std::nullopt};
  reply_bytes_ += bytes_of(entry);
  push(std::move(entry));
}

std::size_t OutputQueue::largest_reply_bytes() const {
  std::size_t largest = 0;
  for (const Entry& entry : entries_) {
    if (!entry.stream_id) largest = std::max(largest, bytes_of(entry));
  }
  return largest;
}

void OutputQueue::offer(const StreamFrame& frame, TimePoint now) {
  assert(frame.layer == 0 || frame.delta != nullptr);
  Stream& stream = streams_[frame.stream_id];
  for (std::uint32_t layer = time_layer_max; layer > 0 && layer >= frame.layer && !has_room(stream); --layer) {
    shed(frame.stream_id, stream, layer);
  }
  stream.is_layered = stream.is_layered || frame.layer > 0;
  const bool finds_room =
      has_room(stream) || (frame.layer == 0 && stream.is_layered && may_wait(frame.stream_id, stream, now));
  const bool holds_base =
      stream.last_tick == frame.base_tick || (frame.layer > 0 && stream.middle_tick == frame.base_tick);
  if (finds_room && frame.delta != nullptr && holds_base) return push_frame(frame.delta, frame, stream, now);
  if (frame.layer > 0) {
    if (stream.was_queued) skip(stream, frame.tick, frame.delta->size());
    return;
  }
  if (!finds_room) drop_unsent(frame.stream_id, stream);
  if (frame.key != nullptr) stream.key_asked_for = false;  // where it finds no room, another has to be asked for
  // What a stream's own unsent frames took is free again; where others fill the queue, the key has to wait too.
  if (frame.key != nullptr && has_room()) {
    if (stream.missing_from && *stream.missing_from < frame.tick && stream.was_sent) {
      // The key may be of a frame skipped; and of what a stream that stalled has missed, the last was not even offered.
      const std::uint64_t to_tick = stream.has_stalled ? frame.tick - 1 : std::min(stream.missing_to, frame.tick - 1);
      push({.message = std::make_shared<const std::string>(make_gap_(frame.stream_id, *stream.missing_from, to_tick)),
            .stream_id = frame.stream_id,
            .tick = *stream.missing_from});
    }
    return push_frame(frame.key, frame, stream, now);
  }
  if (stream.was_queued) skip(stream, frame.tick, (frame.delta != nullptr ? frame.delta : frame.key)->size());
  stream.last_tick.reset();
}

bool OutputQueue::may_wait(std::uint32_t stream_id, const Stream& stream, TimePoint now) const {
  if (!has_room()) return false;
  const auto oldest = std::ranges::find_if(
      entries_, [&](const Entry& entry) { return entry.counts_as_frame && entry.stream_id == stream_id; });
  return stream.unsent == 0 || now - oldest->queued_at < layer_0_wait_max;
}

std::vector<std::uint32_t> OutputQueue::keys_to_ask_for() {
  std::vector<std::uint32_t> wanted;
  if (writing_bytes_ > 0 || !has_room()) return wanted;
  for (auto& [stream_id, stream] : streams_) {
    if (stream.last_tick || std::exchange(stream.key_asked_for, true)) continue;
    stream.is_stalled = false;
    wanted.push_back(stream_id);
  }
  return wanted;
}

OutputQueue::Flow OutputQueue::change_of_flow(std::uint32_t stream_id) {
  const auto found = streams_.find(stream_id);
  if (found == streams_.end()) return Flow::same;
  Stream& stream = found->second;
  const bool is_stalled = !stream.last_tick && !stream.key_asked_for && !memory_is_full_;
  stream.has_stalled = stream.has_stalled || is_stalled;
  if (std::exchange(stream.is_stalled, is_stalled) == is_stalled) return Flow::same;
  return is_stalled ? Flow::stalled : Flow::resumed;
}

void OutputQueue::end_stream(std::uint32_t stream_id) {
  const auto found = streams_.find(stream_id);
  if (found == streams_.end()) return;
  drop_unsent(stream_id, found->second);
  streams_.erase(found);
}

std::vector<SharedBytes> OutputQueue::take(std::size_t bytes, TimePoint now) {
  std::vector<SharedBytes> messages;
  while (!entries_.empty() && (messages.empty() || writing_bytes_ + bytes_of(entries_.front()) <= bytes)) {
    Entry& entry = entries_.front();
    const std::size_t size = bytes_of(entry);
    bytes_ -= size;
    writing_bytes_ += size;
    if (!entry.stream_id) {
      reply_bytes_ -= size;
      writing_reply_bytes_ += size;
    }
    if (entry.counts_as_frame) count_sent(entry, now);
    messages.push_back(std::move(entry.message));
    entries_.pop_front();
  }
  return messages;
}

void OutputQueue::clear() {
  entries_.clear();
  bytes_ = 0;
  reply_bytes_ = 0;
}

void OutputQueue::written() {
  writing_bytes_ = 0;
  writing_reply_bytes_ = 0;
  for (auto& [stream_id, stream] : streams_) stream.writing_from.reset();
}

std::vector<StreamStats> OutputQueue::stream_stats(TimePoint now) const {
  std::vector<StreamStats> all;
  for (const auto& [stream_id, stream] : streams_) {
    const auto unsent = std::ranges::find_if(
        entries_, [id = stream_id](const Entry& entry) { return entry.counts_as_frame && entry.stream_id == id; });
    std::optional<TimePoint> oldest = stream.writing_from;
    if (!oldest && unsent != entries_.end()) oldest = unsent->queued_at;
    all.push_back({stream_id, stream.totals, oldest ? now - *oldest : Duration::zero()});
  }
  return all;
}

void OutputQueue::push(Entry entry) {
  bytes_ += bytes_of(entry);
  entries_.push_back(std::move(entry));
}

void OutputQueue::push_frame(const SharedBytes& message, const StreamFrame& frame, Stream& stream, TimePoint now) {
  push({message, frame.stream_id, frame.tick, true, frame.layer, frame.vertices, now});
  if (frame.layer == 0) stream.last_tick = frame.tick;
  if (frame.layer < time_layer_max) stream.middle_tick.reset();
  if (frame.layer == 1) stream.middle_tick = frame.tick;
  stream.missing_from.reset();
  stream.missing_to = 0;
  stream.has_stalled = false;
  stream.was_queued = true;
  ++stream.unsent;
}

void OutputQueue::count_sent(const Entry& entry, TimePoint now) {
  Stream& stream = streams_[*entry.stream_id];
  --stream.unsent;
  stream.was_sent = true;
  if (!stream.writing_from) stream.writing_from = entry.queued_at;
  ages_.add(now - entry.queued_at);
  for (FrameTotals* totals : {&totals_, &stream.totals}) {
    ++totals->frames_sent;
    totals->bytes_sent += length_prefix_bytes + entry.message->size();
    totals->vertices_sent += entry.vertices;
  }
}

void OutputQueue::skip(Stream& stream, std::uint64_t tick, std::size_t bytes) {
  stream.missing_from = std::min(stream.missing_from.value_or(tick), tick);
  stream.missing_to = std::max(stream.missing_to, tick);
  for (FrameTotals* totals : {&totals_, &stream.totals}) {
    ++totals->frames_dropped;
    totals->bytes_dropped += bytes;
  }
}

// What is unsent of a layer, all higher ones being gone already.
void OutputQueue::shed(std::uint32_t stream_id, Stream& stream, std::uint32_t layer) {
  std::erase_if(entries_, [&](const Entry& entry) {
    if (entry.stream_id != stream_id || !entry.counts_as_frame || entry.layer != layer) return false;
    bytes_ -= bytes_of(entry);
    --stream.unsent;
    skip(stream, entry.tick, entry.message->size());
    if (stream.middle_tick == entry.tick) stream.middle_tick.reset();
    return true;
  });
}

// Oldest first, so that the gap begins with the first tick that is lost; an unsent gap's own ticks are part of the new
// one.
void OutputQueue::drop_unsent(std::uint32_t stream_id, Stream& stream) {
  std::erase_if(entries_, [&](const Entry& entry) {
    if (entry.stream_id != stream_id) return false;
    bytes_ -= bytes_of(entry);
    if (entry.counts_as_frame) {
      skip(stream, entry.tick, entry.message->size());
    } else {
      stream.missing_from = std::min(stream.missing_from.value_or(entry.tick), entry.tick);
    }
    return true;
  });
  stream.unsent = 0;
  stream.last_tick.reset();
  stream.middle_tick.reset();
}

}  // namespace pneuma::net
