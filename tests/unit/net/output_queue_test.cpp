// Shows what a client gets of its queue, whatever the interleaving of publishes and writes: deltas that build on the
// last frame it got, gaps that name exactly what it missed, every reply in order. Frames are written as text, so that a
// model of a client can check them.
#include "net/output_queue.h"

#include <chrono>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace pneuma::net {
namespace {

SharedBytes text(const std::string& words, std::size_t bytes = 0) {
  std::string message = words;
  if (message.size() < bytes) message.resize(bytes, ' ');
  return std::make_shared<const std::string>(std::move(message));
}

std::string gap(std::uint32_t stream, std::uint64_t from, std::uint64_t to) {
  return "gap " + std::to_string(stream) + " " + std::to_string(from) + " " + std::to_string(to);
}

StreamFrame frame(std::uint32_t stream, std::uint64_t tick, std::uint64_t base_tick, bool with_key,
                  std::size_t bytes = 0) {
  const std::string name = std::to_string(stream) + " " + std::to_string(tick);
  StreamFrame out;
  out.stream_id = stream;
  out.tick = tick;
  out.base_tick = base_tick;
  out.delta = text("delta " + name + " " + std::to_string(base_tick), bytes);
  if (with_key) out.key = text("key " + name, bytes);
  return out;
}

std::vector<std::string> take_words(OutputQueue& queue, std::size_t bytes = 1'000'000) {
  std::vector<std::string> words;
  for (const SharedBytes& message : queue.take(bytes, TimePoint()))
    words.push_back(message->substr(0, message->find_last_not_of(' ') + 1));
  queue.written();
  return words;
}

using Words = std::vector<std::string>;
using Streams = std::vector<std::uint32_t>;

TEST(OutputQueue, AJoinerGetsAKeyWithoutGapThenDeltas) {
  OutputQueue queue(1000, gap);
  queue.offer(frame(1, 5, 4, false), TimePoint());
  EXPECT_EQ(queue.keys_to_ask_for(), Streams{1});
  queue.offer(frame(1, 6, 5, false), TimePoint());
  EXPECT_EQ(queue.keys_to_ask_for(), Streams{}) << "it was asked for";
  queue.offer(frame(1, 7, 6, true), TimePoint());
  queue.offer(frame(1, 8, 7, true), TimePoint());
  EXPECT_EQ(take_words(queue), (Words{"key 1 7", "delta 1 8 7"}));
  EXPECT_EQ(queue.totals().frames_dropped, 0U) << "a joiner misses nothing";
}

TEST(OutputQueue, TheBufferIsShared) {
  OutputQueue queue(1000, gap);
  const StreamFrame key = frame(1, 1, 0, true);
  queue.offer(key, TimePoint());
  EXPECT_EQ(queue.take(1000, TimePoint()).front().get(), key.key.get());
}

TEST(OutputQueue, TooManyUnsentFramesAreReplacedByAGapAndAKey) {
  OutputQueue queue(1'000'000, gap);
  queue.offer(frame(1, 1, 0, true), TimePoint());
  EXPECT_EQ(take_words(queue), Words{"key 1 1"});
  for (std::uint64_t tick = 2; tick <= stream_frames_queued_max + 2; ++tick)
    queue.offer(frame(1, tick, tick - 1, false), TimePoint());
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.keys_to_ask_for(), Streams{1});
  queue.offer(frame(1, 7, 6, true), TimePoint());
  EXPECT_EQ(take_words(queue), (Words{"gap 1 2 6", "key 1 7"}));
  EXPECT_EQ(queue.totals().frames_dropped, 5U);
  EXPECT_EQ(queue.totals().frames_sent, 2U);
}

TEST(OutputQueue, AnUnsentGapIsPartOfTheNextOne) {
  OutputQueue queue(1'000'000, gap);
  queue.offer(frame(1, 1, 0, true), TimePoint());
  EXPECT_EQ(take_words(queue).size(), 1U);
  queue.offer(frame(1, 3, 2, false), TimePoint());  // its base never came
  queue.offer(frame(1, 4, 3, true), TimePoint());
  for (std::uint64_t tick = 5; tick <= 8; ++tick) queue.offer(frame(1, tick, tick - 1, tick == 8), TimePoint());
  EXPECT_EQ(take_words(queue), (Words{"gap 1 3 7", "key 1 8"}));
}

TEST(OutputQueue, AGapBeginsWithTheOldestLossWhateverTheOrderOfLosing) {
  OutputQueue queue(100, gap);
  queue.offer(frame(1, 1, 0, true), TimePoint());
  EXPECT_EQ(take_words(queue), Words{"key 1 1"});
  queue.offer(frame(1, 2, 1, false), TimePoint());
  queue.offer(frame(1, 4, 3, false), TimePoint());  // skipped while tick 2 still waits
  EXPECT_TRUE(queue.push_reply(text("reply", 200)));
  queue.offer(frame(1, 5, 4, false), TimePoint());  // the queue is full: tick 2 goes too
  EXPECT_EQ(take_words(queue), Words{"reply"});
  queue.offer(frame(1, 6, 5, true), TimePoint());
  EXPECT_EQ(take_words(queue), (Words{"gap 1 2 5", "key 1 6"}));
}

TEST(OutputQueue, AKeyWithoutDeltaReplacesTheChain) {
  OutputQueue queue(1000, gap);
  queue.offer(frame(1, 1, 0, true), TimePoint());
  StreamFrame edited = frame(1, 1, 0, true);  // of a paused world
  edited.delta = nullptr;
  queue.offer(edited, TimePoint());
  queue.offer(frame(1, 2, 1, false), TimePoint());
  EXPECT_EQ(take_words(queue), (Words{"key 1 1", "key 1 1", "delta 1 2 1"}));
}

TEST(OutputQueue, NothingIsAskedForWhileTheClientTakesNothing) {
  OutputQueue queue(100, gap);
  queue.offer(frame(1, 1, 0, true, 150), TimePoint());
  const auto writing = queue.take(1, TimePoint());  // and the write does not end
  queue.offer(frame(1, 2, 1, true), TimePoint());
  EXPECT_EQ(queue.keys_to_ask_for(), Streams{});
  queue.written();
  EXPECT_EQ(queue.keys_to_ask_for(), Streams{1});
  queue.offer(frame(1, 3, 2, true), TimePoint());
  EXPECT_EQ(take_words(queue), (Words{"gap 1 2 2", "key 1 3"}));
}

TEST(OutputQueue, TellsOnceThatAStreamStallsAndWhenItGoesOn) {
  using Flow = OutputQueue::Flow;
  OutputQueue queue(100, gap);
  queue.offer(frame(1, 1, 0, true, 150), TimePoint());
  EXPECT_EQ(queue.change_of_flow(1), Flow::same);
  const auto writing = queue.take(1, TimePoint());  // and the write does not end
  queue.offer(frame(1, 2, 1, true), TimePoint());
  EXPECT_EQ(queue.change_of_flow(1), Flow::stalled);
  queue.offer(frame(1, 3, 2, false), TimePoint());
  EXPECT_EQ(queue.change_of_flow(1), Flow::same);
  queue.written();
  EXPECT_EQ(queue.keys_to_ask_for(), Streams{1});
  EXPECT_EQ(queue.change_of_flow(1), Flow::same) << "that it wants a key says it";
  queue.offer(frame(1, 9, 8, true), TimePoint());
  EXPECT_EQ(queue.change_of_flow(1), Flow::same);
  EXPECT_EQ(take_words(queue), (Words{"gap 1 2 8", "key 1 9"})) << "what was not offered is missing too";
}

TEST(OutputQueue, WhereMemoryIsFullNoStreamStalls) {
  OutputQueue queue(1000, gap);
  queue.set_memory_full(true);
  queue.offer(frame(1, 1, 0, true), TimePoint());
  EXPECT_EQ(queue.keys_to_ask_for(), Streams{});
  EXPECT_EQ(queue.change_of_flow(1), OutputQueue::Flow::same) << "no write will end, so only an offer can go on";
  queue.set_memory_full(false);
  queue.offer(frame(1, 2, 1, false), TimePoint());
  EXPECT_EQ(queue.keys_to_ask_for(), Streams{1});
}

// As where others' bytes leave, and a key is on its way that was not asked for.
TEST(OutputQueue, TellsThatAStreamGoesOnByAKeyOfItself) {
  using Flow = OutputQueue::Flow;
  OutputQueue queue(100, gap);
  ASSERT_TRUE(queue.push_reply(text("reply", 300)));
  queue.offer(frame(1, 1, 0, true), TimePoint());
  EXPECT_EQ(queue.change_of_flow(1), Flow::stalled);
  take_words(queue);
  queue.offer(frame(1, 2, 1, true), TimePoint());
  EXPECT_EQ(queue.change_of_flow(1), Flow::resumed);
  EXPECT_EQ(queue.change_of_flow(2), Flow::same) << "no such stream";
}

TEST(OutputQueue, RepliesAreRefusedPastTheLimitAlone) {
  OutputQueue queue(100 + queued_message_overhead_bytes, gap);
  EXPECT_TRUE(queue.push_reply(text("a", 99)));
  EXPECT_TRUE(queue.push_reply(text("b", 500))) << "one may be larger than the limit";
  EXPECT_TRUE(queue.push_reply(text("c", 10))) << "and others may wait beside it";
  EXPECT_FALSE(queue.push_reply(text("d")));
  EXPECT_EQ(take_words(queue), (Words{"a", "b", "c"}));
  EXPECT_TRUE(queue.push_reply(text("d")));
}

TEST(OutputQueue, SmallMessagesCountAsTheMemoryThatTheyTake) {
  OutputQueue queue(100 * queued_message_overhead_bytes, gap);
  std::size_t taken = 0;
  while (taken < 1'000 && queue.push_reply(text("?"))) ++taken;
  EXPECT_GE(taken, 90U);
  EXPECT_LE(taken, 101U);
  EXPECT_GE(queue.bytes(), taken * queued_message_overhead_bytes);
  EXPECT_EQ(queue.reply_bytes(), queue.bytes());
  while (!queue.empty()) take_words(queue);
  EXPECT_EQ(queue.bytes(), 0U);
  EXPECT_EQ(queue.reply_bytes(), 0U);
}

TEST(OutputQueue, WhileMemoryIsFullFramesFindNoRoomAndRepliesDo) {
  OutputQueue queue(1'000'000, gap);
  queue.offer(frame(1, 1, 0, true), TimePoint());
  EXPECT_EQ(take_words(queue), Words{"key 1 1"});
  queue.set_memory_full(true);
  queue.offer(frame(1, 2, 1, true), TimePoint());
  EXPECT_TRUE(queue.push_reply(text("reply")));
  EXPECT_EQ(queue.keys_to_ask_for(), Streams{});
  EXPECT_EQ(take_words(queue), Words{"reply"});
  queue.set_memory_full(false);
  EXPECT_EQ(queue.keys_to_ask_for(), Streams{1});
  queue.offer(frame(1, 3, 2, true), TimePoint());
  EXPECT_EQ(take_words(queue), (Words{"gap 1 2 2", "key 1 3"}));
}

TEST(OutputQueue, FramesNeverPushOutReplies) {
  OutputQueue queue(100, gap);
  queue.offer(frame(1, 1, 0, true, 200), TimePoint());
  EXPECT_TRUE(queue.push_reply(text("reply", 50)));
  queue.offer(frame(2, 1, 0, true, 200), TimePoint());
  EXPECT_EQ(take_words(queue), (Words{"key 1 1", "reply"}));
}

TEST(OutputQueue, AnEndedStreamIsForgotten) {
  OutputQueue queue(1000, gap);
  queue.offer(frame(1, 1, 0, true), TimePoint());
  queue.offer(frame(2, 1, 0, true), TimePoint());
  queue.end_stream(1);
  EXPECT_EQ(take_words(queue), Words{"key 2 1"});
  queue.offer(frame(1, 2, 1, true), TimePoint());
  EXPECT_EQ(take_words(queue), Words{"key 1 2"}) << "a joiner again: no delta, no gap";
}

// Frames 0 1 2 3 4... of a stream in layers 0 2 1 2 0..., each on the last one of a lower layer.
StreamFrame layered(std::uint64_t tick, bool with_key = false) {
  const std::uint64_t place = tick % 4;
  const std::uint32_t layer = place == 0 ? 0 : (place == 2 ? 1 : 2);
  const std::uint64_t base_tick = place == 0 ? tick - 4 : tick - (place == 3 ? 1 : place);
  StreamFrame out = frame(1, tick, base_tick, with_key);
  out.layer = layer;
  return out;
}

TEST(OutputQueue, ASlowReaderOfLayersShedsTheHighestFirst) {
  OutputQueue queue(1'000'000, gap);
  queue.offer(layered(4, true), TimePoint());
  EXPECT_EQ(take_words(queue), Words{"key 1 4"});
  for (std::uint64_t tick = 5; tick <= 8; ++tick) queue.offer(layered(tick), TimePoint());
  queue.offer(layered(9), TimePoint());  // no room: the frames of layer 2 go, but for itself
  EXPECT_EQ(take_words(queue), (Words{"delta 1 6 4", "delta 1 8 4", "delta 1 9 8"}));
  EXPECT_EQ(queue.totals().frames_dropped, 2U);
  for (std::uint64_t tick = 10; tick <= 16; ++tick) queue.offer(layered(tick), TimePoint());
  EXPECT_EQ(take_words(queue), (Words{"delta 1 10 8", "delta 1 12 8", "delta 1 14 12", "delta 1 16 12"}));
  for (std::uint64_t tick = 17; tick <= 28; ++tick) queue.offer(layered(tick), TimePoint());
  EXPECT_EQ(take_words(queue), (Words{"delta 1 20 16", "delta 1 24 20", "delta 1 26 24", "delta 1 28 24"}));
  EXPECT_EQ(queue.keys_to_ask_for(), Streams{}) << "nothing that later frames need was lost";
}

TEST(OutputQueue, AFrameOnOneThatWasShedIsLeftOut) {
  OutputQueue queue(100 + 3 * queued_message_overhead_bytes, gap);
  queue.offer(layered(4, true), TimePoint());
  queue.offer(layered(6), TimePoint());
  EXPECT_TRUE(queue.push_reply(text("reply", 200)));
  queue.offer(layered(7), TimePoint());  // the queue is full: it is left out alone
  EXPECT_EQ(take_words(queue), (Words{"key 1 4", "delta 1 6 4", "reply"}));
  queue.offer(layered(8), TimePoint());
  queue.offer(layered(10), TimePoint());
  EXPECT_TRUE(queue.push_reply(text("reply", 200)));
  queue.offer(layered(14), TimePoint());
  EXPECT_EQ(take_words(queue), (Words{"delta 1 8 4", "reply"})) << "a frame of layer 1 makes others of it give way";
  queue.offer(layered(11), TimePoint());
  EXPECT_EQ(take_words(queue), Words{}) << "10 never came";
  queue.offer(layered(12), TimePoint());
  EXPECT_EQ(take_words(queue), Words{"delta 1 12 8"}) << "no gap, no key";
}

// What a reader that takes nothing for a while loses of a stream of 40 frames a second: all but those of layer 0, and
// those too where it takes too long.
TEST(OutputQueue, LayerZeroWaitsForAReaderThatPausesAndNotForOneThatStops) {
  OutputQueue queue(1'000'000, gap);
  queue.offer(layered(4, true), TimePoint());
  EXPECT_EQ(take_words(queue), Words{"key 1 4"});
  const auto time_of = [](std::uint64_t tick) { return TimePoint() + tick * std::chrono::milliseconds(25); };
  const std::uint64_t ticks_waited = layer_0_wait_max / std::chrono::milliseconds(25);
  for (std::uint64_t tick = 5; tick < 8 + ticks_waited; ++tick) queue.offer(layered(tick), time_of(tick));
  OutputQueue paused = queue;
  std::uint64_t expected = 8;
  for (const std::string& words : take_words(paused)) {
    EXPECT_EQ(words, "delta 1 " + std::to_string(expected) + " " + std::to_string(expected - 4));
    expected += 4;
  }
  EXPECT_EQ(expected, 8 + ticks_waited) << "all of layer 0, and no others";
  EXPECT_EQ(paused.keys_to_ask_for(), Streams{});

  const std::uint64_t late = 8 + ticks_waited;
  queue.offer(layered(late), time_of(late));
  queue.offer(layered(late + 1), time_of(late + 1));
  EXPECT_TRUE(queue.empty()) << "the frame of tick 8 has waited too long";
  EXPECT_EQ(queue.keys_to_ask_for(), Streams{1});
  StreamFrame key = layered(late, true);  // the last of layer 0 once more, and then what builds on it
  key.delta = nullptr;
  queue.offer(key, time_of(late + 1));
  queue.offer(layered(late + 2), time_of(late + 2));
  const std::string name = std::to_string(late);
  EXPECT_EQ(take_words(queue), (Words{"gap 1 8 " + std::to_string(late - 1), "key 1 " + name,
                                      "delta 1 " + std::to_string(late + 2) + " " + name}));
}

TEST(OutputQueue, TellsHowAStreamIsRead) {
  using namespace std::chrono_literals;
  const TimePoint start;
  OutputQueue queue(1'000'000, gap);
  const auto offer = [&](std::uint64_t tick, Duration at) {
    StreamFrame next = frame(1, tick, tick - 1, tick == 1, 100);
    next.vertices = 42;
    queue.offer(next, start + at);
  };
  offer(1, 0ms);
  offer(2, 10ms);
  EXPECT_EQ(queue.stream_stats(start + 25ms).at(0).queue_age, 25ms);
  const auto writing = queue.take(100, start + 30ms);  // the first alone
  ASSERT_EQ(writing.size(), 1U);
  EXPECT_EQ(queue.stream_stats(start + 35ms).at(0).queue_age, 35ms) << "it is not written yet";
  queue.written();
  EXPECT_EQ(queue.stream_stats(start + 35ms).at(0).queue_age, 25ms);
  for (std::uint64_t tick = 3; tick <= 6; ++tick) offer(tick, 40ms);
  const StreamStats stats = queue.stream_stats(start + 50ms).at(0);
  EXPECT_EQ(stats.queue_age, 0ms) << "none waits: the last one found no room, and took the others along";
  EXPECT_EQ(stats.totals.frames_sent, 1U);
  EXPECT_EQ(stats.totals.vertices_sent, 42U);
  EXPECT_EQ(stats.totals.bytes_sent, 104U) << "its length counts";
  EXPECT_EQ(stats.totals.frames_dropped, 5U);
  EXPECT_EQ(stats.totals.bytes_dropped, 500U);
  EXPECT_NEAR(queue.ages().sum_s, 0.03, 1e-9);
  queue.end_stream(1);
  EXPECT_TRUE(queue.stream_stats(start).empty());
  EXPECT_EQ(queue.totals().frames_dropped, 5U) << "what was, stays counted";
}

// What a client knows, checked at each message.
class Client {
 public:
  void receive(const std::string& message) {
    std::istringstream words(message);
    std::string kind;
    std::uint32_t stream = 0;
    words >> kind;
    if (kind == "reply") {
      int number = 0;
      words >> number;
      EXPECT_EQ(number, ++replies_) << "replies are complete and in order";
      return;
    }
    std::uint64_t first = 0;
    std::uint64_t second = 0;
    words >> stream >> first >> second;
    if (kind == "gap") return expect_gap(stream, first, second);
    if (kind == "delta") {
      ASSERT_TRUE(last_.contains(stream));
      EXPECT_EQ(second, last_[stream]) << "a delta builds on the last frame";
      EXPECT_FALSE(in_gap_.contains(stream)) << "a key follows a gap";
    }
    // Ticks follow each other but for those a gap named; a joiner's first frame may be any.
    if (last_.contains(stream)) {
      EXPECT_EQ(first, (in_gap_.contains(stream) ? in_gap_ : last_)[stream] + 1) << message;
    }
    in_gap_.erase(stream);
    last_[stream] = first;
  }
  [[nodiscard]] int replies() const { return replies_; }

 private:
  void expect_gap(std::uint32_t stream, std::uint64_t from, std::uint64_t to) {
    ASSERT_TRUE(last_.contains(stream)) << "a joiner has no gap";
    EXPECT_EQ(from, (in_gap_.contains(stream) ? in_gap_[stream] : last_[stream]) + 1);
    EXPECT_LE(from, to);
    in_gap_[stream] = to;
  }

  int replies_ = 0;
  std::map<std::uint32_t, std::uint64_t> last_;
  std::map<std::uint32_t, std::uint64_t> in_gap_;
};

TEST(OutputQueue, EveryInterleavingIsDecodable) {
  std::mt19937 random(11);
  const auto below = [&](unsigned end) { return static_cast<unsigned>(random() % end); };
  const auto chance = [&](unsigned percent) { return below(100) < percent; };
  std::uint64_t keys = 0;
  for (int round = 0; round < 300; ++round) {
    constexpr std::size_t bytes_max = 2'000;
    OutputQueue queue(bytes_max, gap);
    Client client;
    std::map<std::uint32_t, std::uint64_t> ticks;
    std::set<std::uint32_t> wanted;
    std::set<std::uint32_t> stalled;  // of which no frame is offered, in every other round
    int replies = 0;
    std::vector<SharedBytes> writing;
    const auto finish_write = [&] {
      for (const SharedBytes& message : writing) client.receive(*message);
      writing.clear();
      queue.written();
    };
    const unsigned drain_percent = 5 + below(60);
    for (int step = 0; step < 400; ++step) {
      if (chance(50)) {
        const std::uint32_t stream = 1 + below(3);
        const std::uint64_t tick = ++ticks[stream];
        if (round % 2 == 0 && stalled.contains(stream)) continue;
        const bool with_key = wanted.erase(stream) > 0 || tick == 1 || chance(3);
        queue.offer(frame(stream, tick, tick - 1, with_key, 20 + below(400)), TimePoint());
        keys += with_key ? 1U : 0U;
        const OutputQueue::Flow flow = queue.change_of_flow(stream);
        if (flow == OutputQueue::Flow::stalled) {
          EXPECT_TRUE(stalled.insert(stream).second);
        } else if (flow == OutputQueue::Flow::resumed) {
          EXPECT_EQ(stalled.erase(stream), 1U);
        }
      } else if (chance(20)) {
        if (queue.push_reply(text("reply " + std::to_string(replies + 1), below(200)))) ++replies;
      } else if (chance(drain_percent)) {
        finish_write();
        writing = queue.take(1 + below(600), TimePoint());
      }
      for (const std::uint32_t stream : queue.keys_to_ask_for()) {
        EXPECT_TRUE(wanted.insert(stream).second) << "asked for once";
        stalled.erase(stream);
      }
      ASSERT_LE(queue.bytes(), 3 * bytes_max);
    }
    do {
      finish_write();
      writing = queue.take(500, TimePoint());
    } while (!writing.empty());
    finish_write();
    EXPECT_EQ(client.replies(), replies);
    EXPECT_EQ(queue.bytes(), 0U);
    if (testing::Test::HasFailure()) FAIL() << "in round " << round;
  }
  EXPECT_GT(keys, 900U) << "the streams were interrupted at all";
}

}  // namespace
}  // namespace pneuma::net
