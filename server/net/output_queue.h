// What waits to be written to one session: replies, which are never dropped, and the frames of its streams, which are.
// Owns no socket.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "net/server.h"

namespace pneuma::net {

/// What a message takes in memory beside its bytes: its place in the queue, what owns it, and the allocator's own.
inline constexpr std::size_t queued_message_overhead_bytes = 160;

/// A reader this many frames of a stream behind is better served by fewer layers, or one key frame.
inline constexpr std::size_t stream_frames_queued_max = 4;

/// As long as this a frame of layer 0 may wait, of a stream in layers whose higher ones are gone. Losing it costs a gap
/// and a key frame. A reader at a third of the stream's rate keeps up with layer 0, but takes it in bursts: with what
/// its socket and ours hold, of 64 KiB and more.
inline constexpr std::chrono::seconds layer_0_wait_max{2};

class OutputQueue {
 public:
  using MakeGap = std::function<std::string(std::uint32_t stream_id, std::uint64_t from_tick, std::uint64_t to_tick)>;

  OutputQueue(std::size_t bytes_max, MakeGap make_gap) : bytes_max_(bytes_max), make_gap_(std::move(make_gap)) {}

  /// False where the replies that wait already, the largest left out, fill the queue: the session is to be closed.
  [[nodiscard]] bool push_reply(SharedBytes message);

  /// While it is, frames find no room: too much waits in memory for all sessions together.
  void set_memory_full(bool memory_is_full) { memory_is_full_ = memory_is_full; }

  /// A last message, past any limit.
  void push_goodbye(SharedBytes message);

  /// Queues the frame as delta where the client will hold its base and there is room. A stream with too much unsent
  /// first sheds what is unsent of layers that nothing after builds on, the highest first. Where that is not enough, a
  /// frame of a higher layer is left out alone; one of layer 0 waits with those before it, up to layer_0_wait_max. Past
  /// that, and of a stream without layers at once, it takes along all that is unsent, and comes as key, after a gap
  /// that spans what was skipped; or is skipped as well, and the stream waits for a key.
  void offer(const StreamFrame& frame, TimePoint now);

  /// The streams that wait for a key which could be queued now, each once until a key was offered. A client that takes
  /// nothing is asked for nothing: its key would be out of date before it left.
  [[nodiscard]] std::vector<std::uint32_t> keys_to_ask_for();

  /// What has changed since it was last asked: whether frames of the stream come to nothing until a write has ended.
  /// Not where memory is full: only the next offer says that it is no longer.
  enum class Flow { same, stalled, resumed };
  [[nodiscard]] Flow change_of_flow(std::uint32_t stream_id);

  /// Drops the stream's unsent frames and forgets it.
  void end_stream(std::uint32_t stream_id);

  /// Takes the next messages for one write, at most `bytes` of them where the first is smaller; they count until
  /// written() is called.
  [[nodiscard]] std::vector<SharedBytes> take(std::size_t bytes, TimePoint now);
  void written();

  /// The session is over: all that waits goes at once.
  void clear();

  [[nodiscard]] bool empty() const { return entries_.empty(); }
  /// In memory.
  [[nodiscard]] std::size_t bytes() const { return bytes_ + writing_bytes_; }
  /// Of the replies that wait.
  [[nodiscard]] std::size_t reply_bytes() const { return reply_bytes_; }
  /// And of those that are being written: they are in memory until the client has taken them.
  [[nodiscard]] std::size_t unread_reply_bytes() const { return reply_bytes_ + writing_reply_bytes_; }
  /// Of all streams, those that ended included.
  [[nodiscard]] const FrameTotals& totals() const { return totals_; }
  [[nodiscard]] const QueueAges& ages() const { return ages_; }
  [[nodiscard]] std::vector<StreamStats> stream_stats(TimePoint now) const;

 private:
  struct Entry {
    SharedBytes message;
    std::optional<std::uint32_t> stream_id;  // none: a reply
    std::uint64_t tick = 0;
    bool counts_as_frame = false;  // a gap belongs to its stream but is no frame
    std::uint32_t layer = 0;
    std::size_t vertices = 0;
    TimePoint queued_at{};
  };
  struct Stream {
    std::optional<std::uint64_t> last_tick;    // of the last frame of layer 0; none: a key is needed
    std::optional<std::uint64_t> middle_tick;  // of the one of layer 1 since then
    std::optional<std::uint64_t>
        missing_from;  // first tick that was skipped since the last frame queued; none: none was
    std::uint64_t missing_to = 0;
    bool key_asked_for = false;
    bool is_stalled = false;   // as change_of_flow last told
    bool has_stalled = false;  // since its last frame was queued
    bool was_queued = false;   // it has had a frame in the queue: what it misses from now on counts as dropped
    bool was_sent = false;     // it has had a frame written: what it misses from now on is a gap
    bool is_layered = false;   // it has had a frame of a higher layer
    std::size_t unsent = 0;
    std::optional<TimePoint> writing_from;  // when the oldest frame of the write under way was queued
    FrameTotals totals;
  };

  [[nodiscard]] bool has_room(const Stream& stream) const {
    return stream.unsent < stream_frames_queued_max && has_room();
  }
  [[nodiscard]] bool has_room() const { return bytes() < bytes_max_ && !memory_is_full_; }
  [[nodiscard]] static std::size_t bytes_of(const Entry& entry) {
    return entry.message->size() + queued_message_overhead_bytes;
  }
  /// Whether a frame of layer 0 may wait behind those that do, more of them than others may.
  [[nodiscard]] bool may_wait(std::uint32_t stream_id, const Stream& stream, TimePoint now) const;
  [[nodiscard]] std::size_t largest_reply_bytes() const;
  void shed(std::uint32_t stream_id, Stream& stream, std::uint32_t layer);
  void push(Entry entry);
  void push_frame(const SharedBytes& message, const StreamFrame& frame, Stream& stream, TimePoint now);
  void skip(Stream& stream, std::uint64_t tick, std::size_t bytes);
  void count_sent(const Entry& entry, TimePoint now);
  void drop_unsent(std::uint32_t stream_id, Stream& stream);

  std::size_t bytes_max_;
  bool memory_is_full_ = false;
  MakeGap make_gap_;
  std::deque<Entry> entries_;
  std::map<std::uint32_t, Stream> streams_;
  std::size_t bytes_ = 0;
  std::size_t reply_bytes_ = 0;
  std::size_t writing_bytes_ = 0;
  std::size_t writing_reply_bytes_ = 0;  // of these
  FrameTotals totals_;
  QueueAges ages_;
};

}  // namespace pneuma::net
