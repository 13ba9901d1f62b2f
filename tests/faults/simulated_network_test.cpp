// Shows that a session keeps its word on any network: lives of a connection, drawn from a seed, against a simulated
// clock and wire. What is sent is delayed, split, merged, cut short, reset and stalled; the client is late, silent,
// greedy or rude. Replies come whole and in order, deltas build on what the client holds, gaps are told, and a
// connection that is over has left nothing behind. A seed that fails names itself: PNEUMA_SEED runs it alone,
// PNEUMA_SEEDS as many as it says.
#include <algorithm>
#include <charconv>
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>

#include "net/session.h"
#include "simulated_wire.h"
#include "support/environment.h"
#include "support/sanitizers.h"

namespace pneuma::net {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t before_hello_bytes_max = 512;
constexpr std::size_t slow_read_bytes = 4'096;  // about every 6 ms
constexpr Duration frame_period = 20ms;
constexpr std::uint32_t stream_id = 1;
// As a stream in time layers goes: the layer of each tick.
constexpr std::array<std::uint32_t, 4> layers{0, 2, 1, 2};

base::Limits simulated_limits() {
  base::Limits limits;
  limits.hello_timeout = 200ms;
  limits.partial_message_timeout = 600ms;
  limits.ping_interval = 400ms;
  limits.write_stall_timeout = 800ms;
  limits.message_bytes_max = 4'096;
  limits.output_queue_bytes_max = 1024 * 1024;
  return limits;
}

enum class Fault : std::uint8_t {
  none,
  silent,         // it never says hello
  reset,          // the connection breaks
  cut,            // it ends in the middle of a message
  stops_sending,  // likewise, and stays open
  stops_reading,
  no_pongs,
  too_long,  // it announces a message past the limit
  empty,     // or of no bytes
  closed,    // by the server's owner
  greedy,    // it asks faster than it reads
  count,
};

std::vector<std::uint64_t> numbers_in(std::string_view text) {
  std::vector<std::uint64_t> numbers;
  while (!text.empty()) {
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    text.remove_prefix(error == std::errc() ? static_cast<std::size_t>(end - text.data()) : 1);
    if (error == std::errc()) numbers.push_back(number);
  }
  return numbers;
}

/// Checks what a client is told, as it is told.
class Listener {
 public:
  std::vector<std::uint64_t> pings;  // not answered
  std::size_t echoes = 0;
  std::size_t gaps = 0;
  bool is_dismissed = false;

  void hear(const std::string& message, const std::set<std::uint64_t>& key_ticks) {
    EXPECT_FALSE(is_dismissed) << "after goodbye: " << message;
    const std::vector<std::uint64_t> numbers = numbers_in(message.substr(0, 64));
    if (message.starts_with("echo")) {
      EXPECT_EQ(numbers.at(0), echoes++);
      EXPECT_EQ(numbers.at(1), message.size());
    } else if (message.starts_with("ping")) {
      pings.push_back(numbers.at(0));
    } else if (message.starts_with("goodbye")) {
      is_dismissed = true;
    } else if (message.starts_with("gap")) {
      EXPECT_TRUE(base_) << "a gap before any frame";
      EXPECT_LE(numbers.at(1), numbers.at(2));
      gap_ = {numbers.at(1), numbers.at(2)};
      ++gaps;
    } else if (message.starts_with("key")) {
      hear_key(numbers.at(0), key_ticks);
    } else {
      ASSERT_TRUE(message.starts_with("delta")) << message;
      hear_delta(numbers.at(0), numbers.at(1), static_cast<std::uint32_t>(numbers.at(2)));
    }
  }

 private:
  void hear_key(std::uint64_t tick, const std::set<std::uint64_t>& key_ticks) {
    EXPECT_GT(tick, last_tick_);
    // Every tick of layer 0 that this client was to have, and did not get, lies in the gap that it was told.
    for (auto missed = key_ticks.upper_bound(last_tick_); base_ && missed != key_ticks.end() && *missed < tick;
         ++missed) {
      EXPECT_TRUE(gap_ && gap_->first <= *missed && *missed <= gap_->second) << "tick " << *missed << " is missing";
    }
    gap_.reset();
    last_tick_ = tick;
    base_ = tick;
    middle_.reset();
  }
  void hear_delta(std::uint64_t tick, std::uint64_t base_tick, std::uint32_t layer) {
    EXPECT_GT(tick, last_tick_);
    EXPECT_TRUE(base_ == base_tick || (layer > 0 && middle_ == base_tick)) << "tick " << tick << " on " << base_tick;
    EXPECT_FALSE(gap_) << "a delta after a gap";
    last_tick_ = tick;
    if (layer == 0) base_ = tick;
    if (layer < time_layer_max) middle_.reset();
    if (layer == 1) middle_ = tick;
  }

  std::uint64_t last_tick_ = 0;
  std::optional<std::uint64_t> base_, middle_;
  std::optional<std::pair<std::uint64_t, std::uint64_t>> gap_;
};

/// One connection from its first byte to its end.
class Life {
 public:
  explicit Life(std::uint64_t seed) : wire_(std::make_shared<Wire>()) {
    random().seed(seed);
    fault_ = static_cast<Fault>(draw(static_cast<std::uint64_t>(Fault::count)));
    wire_->window = 256 + draw(32 * 1024);
    read_bytes_ = fault_ == Fault::greedy ? 8 * 1024 : 64 + draw(8 * 1024);
    frame_bytes_max_ = 100 + draw(draw(2) == 0 ? 1'000 : 16'000);
    fault_at_ = milliseconds(20, 1'500);
  }

  void run() {
    open();
    say_hello();
    clock_.after(fault_at_, [this] { strike(); });
    clock_.after(milliseconds(2'000, 2'500), [this] {
      has_said_all_ = true;
      clock_.at(arrives_at_, [this] { end_sending(); });
    });
    clock_.after(1ms, [this] { read(); });
    clock_.after(frame_period, [this] { publish(); });
    // By then every time limit has had its turn, one after the other.
    const auto end = clock_.now() + 8s;
    do {
      io_.restart();
      io_.poll();
    } while (clock_.pass(end));
    io_.restart();
    io_.poll();
    check_end();
  }

 private:
  [[nodiscard]] std::mt19937_64& random() { return wire_->random; }
  [[nodiscard]] std::uint64_t draw(std::uint64_t below) { return random()() % below; }
  [[nodiscard]] Duration milliseconds(std::uint64_t least, std::uint64_t most) {
    return std::chrono::milliseconds(least + draw(most - least));
  }
  [[nodiscard]] bool strikes(Fault fault) const { return has_struck_ && fault_ == fault; }

  void open() {
    callbacks_.opened = [this](SessionId, const PeerInfo&) { ++opened_; };
    callbacks_.received = [this](SessionId, ReceivedMessage message) { receive(std::move(message)); };
    callbacks_.closed = [this](SessionId, const base::Status&) { ++closed_; };
    callbacks_.key_wanted = [this](SessionId, std::uint32_t) {
      EXPECT_EQ(closed_, 0);
      key_is_wanted_ = true;
    };
    callbacks_.reader_report = [](SessionId, const ReaderReport&) {};
    callbacks_.make_ping = [](std::uint64_t nonce) { return "ping " + std::to_string(nonce); };
    callbacks_.make_goodbye = [](const base::Status& why) { return "goodbye " + why.message(); };
    callbacks_.make_gap = [](std::uint32_t stream, std::uint64_t from, std::uint64_t to) {
      return "gap " + std::to_string(stream) + ' ' + std::to_string(from) + ' ' + std::to_string(to);
    };
    const auto session =
        std::make_shared<Session>(SessionId{1}, PeerInfo{},
                                  std::make_unique<StreamTransport<SimulatedStream>>(
                                      before_hello_bytes_max, received_memory_, io_.get_executor(), wire_),
                                  simulated_limits(), callbacks_, clock_, io_.get_executor(), [this](SessionId) {
                                    ++ended_;
                                    clock_.forget_alarm();
                                  });
    session_ = session;
    session->start();
  }

  // The server's owner echoes, and is busy now and then.
  void receive(ReceivedMessage message) {
    EXPECT_EQ(opened_, 1);
    EXPECT_EQ(closed_, 0);
    const auto session = session_.lock();
    if (message.bytes.starts_with("pong")) return session->pong(numbers_in(message.bytes).at(0));
    EXPECT_EQ(numbers_in(message.bytes.substr(0, 16)).at(0), received_) << "a message is lost, or out of order";
    EXPECT_EQ(numbers_in(message.bytes.substr(0, 16)).at(1), message.bytes.size());
    if (received_++ == 0) session->authenticated();
    session->send(text("echo", received_ - 1, message.bytes.size() + (fault_ == Fault::greedy ? 20'000 : 0)));
    if (draw(8) != 0) return;
    session->hold();
    clock_.after(milliseconds(0, 100), [this] {
      if (const auto held = session_.lock()) held->resume();
    });
  }

  /// WORD NUMBER SIZE and dots, that many bytes in all.
  static SharedBytes text(const std::string& word, std::size_t number, std::size_t size) {
    std::string all = word + ' ' + std::to_string(number) + ' ';
    size = std::max(size, all.size() + 6);
    all += std::to_string(size) + ' ';
    all.resize(size, '.');
    return std::make_shared<const std::string>(std::move(all));
  }

  // The client. Its bytes arrive in order, in pieces.
  void send(const std::string& message) {
    const auto prefix = length_prefix(message.size());
    send_bytes(std::string(prefix.begin(), prefix.end()) + message);
  }
  void send_bytes(std::string bytes) {
    if (has_said_all_) return;
    if (strikes(Fault::stops_sending) || strikes(Fault::cut)) {
      if (is_cut_) return;
      is_cut_ = true;
      bytes.resize(1 + draw(bytes.size() - 1));
    }
    while (!bytes.empty()) {
      const std::size_t size = draw(4) == 0 ? wire_->up_to(bytes.size()) : bytes.size();
      arrives_at_ = std::max(arrives_at_, clock_.now() + milliseconds(0, 30));
      clock_.at(arrives_at_, [this, piece = bytes.substr(0, size)] {
        if (wire_->client_is_done) return;
        wire_->arrived += piece;
        wire_->serve();
      });
      bytes.erase(0, size);
    }
    if (is_cut_ && fault_ == Fault::cut) clock_.at(arrives_at_, [this] { end_sending(); });
  }
  void end_sending() {
    wire_->client_is_done = true;
    wire_->serve();
  }
  void say_hello() {
    if (fault_ == Fault::silent) return;
    clock_.after(milliseconds(0, 100), [this] {
      ask(before_hello_bytes_max);
      clock_.after(milliseconds(1, 40), [this] { go_on_asking(); });
    });
  }
  void ask(std::size_t most) { send(*text("say", asked_++, 16 + draw(draw(4) == 0 ? most - 16 : 200))); }
  void go_on_asking() {
    if (asked_ > 60) return;
    ask(simulated_limits().message_bytes_max);
    clock_.after(fault_ == Fault::greedy ? 1ms : milliseconds(0, 60), [this] {
      if (!has_said_all_ && ended_ == 0) go_on_asking();
    });
  }
  void read() {
    if (!strikes(Fault::stops_reading)) {
      const std::size_t size = std::min(read_bytes_, wire_->on_its_way.size());
      std::string_view bytes(wire_->on_its_way.data(), size);
      while (true) {
        const auto message = reader_.take(bytes);
        ASSERT_TRUE(message.ok()) << message.status().message();
        if (!*message) break;
        listener_.hear(**message, layer_0_ticks_);
      }
      wire_->on_its_way.erase(0, size);
      if (!strikes(Fault::no_pongs)) {
        for (const std::uint64_t nonce : std::exchange(listener_.pings, {})) send("pong " + std::to_string(nonce));
      }
      if (wire_->server_is_done && wire_->on_its_way.empty()) wire_->client_is_done = true;
    }
    wire_->serve();
    if (ended_ == 0 || !wire_->on_its_way.empty()) {
      clock_.after(milliseconds(1, 12), [this] {
        if (clock_.now() < Clock::TimePoint(1'007s)) read();
      });
    }
  }
  void strike() {
    has_struck_ = true;
    if (fault_ == Fault::reset) wire_->is_reset = true;
    if (fault_ == Fault::too_long) send_bytes(std::string("\x7f\xff\xff\xff", 4));
    if (fault_ == Fault::empty) send_bytes(std::string(4, '\0'));
    if (fault_ == Fault::cut || fault_ == Fault::stops_sending) ask(simulated_limits().message_bytes_max);
    if (fault_ == Fault::closed) {
      if (const auto session = session_.lock()) session->close({base::StatusCode::unavailable, "enough"});
    }
    wire_->serve();
  }

  // The server's world.
  void publish() {
    const auto session = session_.lock();
    if (!session || ended_ > 0) return;
    const std::uint64_t tick = ++tick_;
    const std::uint32_t layer = layers[tick % layers.size()];
    StreamFrame frame{.stream_id = stream_id, .tick = tick, .layer = layer, .delta = nullptr, .key = nullptr};
    frame.base_tick = layer == 2 ? std::max(newest_[0], newest_[1]) : newest_[0];
    const auto bytes = [&](const std::string& head) {
      std::string all = head;
      all.resize(40 + draw(frame_bytes_max_), '.');
      return std::make_shared<const std::string>(std::move(all));
    };
    if (tick > layers.size()) {
      frame.delta = bytes("delta " + std::to_string(tick) + ' ' + std::to_string(frame.base_tick) + ' ' +
                          std::to_string(layer) + ' ');
    }
    if (layer == 0 && (tick == layers.size() || std::exchange(key_is_wanted_, false))) {
      frame.key = bytes("key " + std::to_string(tick) + ' ');
    }
    if (layer == 0) layer_0_ticks_.insert(tick);
    newest_[layer] = tick;
    if (received_ > 0 && (frame.delta || frame.key)) session->offer(frame, draw(200) == 0);
    clock_.after(frame_period, [this] { publish(); });
  }

  void check_end() {
    EXPECT_EQ(ended_, 1);
    EXPECT_EQ(closed_, opened_);
    EXPECT_TRUE(session_.expired()) << "a part of the session goes on";
    EXPECT_EQ(received_memory_.bytes(), 0U);
    // Who reads slowly has no more than the time of a stalled write for what waits when the session closes.
    const bool is_slow = std::min(read_bytes_, wire_->window) < slow_read_bytes;
    const bool reads_all = fault_ == Fault::none || fault_ == Fault::greedy || fault_ == Fault::too_long ||
                           fault_ == Fault::empty || fault_ == Fault::closed || fault_ == Fault::cut;
    if (is_slow || !reads_all) return;
    EXPECT_EQ(listener_.echoes, received_);
    EXPECT_TRUE(listener_.is_dismissed);
    if (fault_ == Fault::none || fault_ == Fault::greedy) {
      EXPECT_EQ(received_, asked_);
    }
  }

  SimulatedClock clock_;
  asio::io_context io_{1};
  std::shared_ptr<Wire> wire_;
  const base::MemoryBudget received_memory_{1'000'000};
  Callbacks callbacks_;
  std::weak_ptr<Session> session_;
  int opened_ = 0, closed_ = 0, ended_ = 0;
  std::size_t received_ = 0;
  bool key_is_wanted_ = false;
  std::uint64_t tick_ = 0;
  std::array<std::uint64_t, 3> newest_{};  // tick of each layer
  std::set<std::uint64_t> layer_0_ticks_;

  Fault fault_ = Fault::none;
  Duration fault_at_{};
  bool has_struck_ = false;
  bool is_cut_ = false;
  bool has_said_all_ = false;
  std::size_t read_bytes_ = 0, frame_bytes_max_ = 0;
  std::size_t asked_ = 0;
  Clock::TimePoint arrives_at_{};
  FrameReader reader_{32 * 1024};
  Listener listener_;
};

TEST(SimulatedNetwork, ASessionKeepsItsWordOnAnyWire) {
  if (const std::uint64_t seed = support::number_from_environment("PNEUMA_SEED", 0); seed != 0) return Life(seed).run();
  const std::uint64_t seeds = support::number_from_environment("PNEUMA_SEEDS", support::is_sanitized ? 1'000 : 10'000);
  for (std::uint64_t seed = 1; seed <= seeds && !HasFailure(); ++seed) {
    SCOPED_TRACE("PNEUMA_SEED=" + std::to_string(seed));
    Life(seed).run();
  }
}

}  // namespace
}  // namespace pneuma::net
