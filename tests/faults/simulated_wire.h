#pragma once
/// A network and a clock that a test writes: what a session sees of them is drawn from a seed.
#include <algorithm>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include "net/clock.h"
#include "net/stream_transport.h"

namespace pneuma::net {

using boost::system::error_code;
using Duration = Clock::Duration;

/// Time passes from one entry of the agenda to the next.
class SimulatedClock : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override { return now_; }
  /// One timer at a time: a session has one.
  void set(asio::steady_timer& timer, Duration after) override {
    timer.expires_at(TimePoint::max());
    alarm_ = &timer;
    alarm_at_ = now_ + after;
  }
  void forget_alarm() { alarm_ = nullptr; }

  void at(TimePoint time, std::function<void()> work) { agenda_.emplace(std::max(time, now_), std::move(work)); }
  void after(Duration time, std::function<void()> work) { at(now_ + time, std::move(work)); }
  /// Does what comes next; false where that is nothing before `end`.
  bool pass(TimePoint end) {
    const bool rings = alarm_ != nullptr && (agenda_.empty() || alarm_at_ <= agenda_.begin()->first);
    if (!rings && agenda_.empty()) return false;
    const TimePoint next = rings ? alarm_at_ : agenda_.begin()->first;
    if (next > end) return false;
    now_ = next;
    if (rings) {
      std::exchange(alarm_, nullptr)->cancel();
    } else {
      agenda_.extract(agenda_.begin()).mapped()();
    }
    return true;
  }

 private:
  TimePoint now_{std::chrono::seconds(1'000)};
  std::multimap<TimePoint, std::function<void()>> agenda_;
  asio::steady_timer* alarm_ = nullptr;
  TimePoint alarm_at_{};
};

/// What a read or a write under way calls at its end.
class Completion {
 public:
  Completion() = default;
  template <class Handler>
  Completion(asio::any_io_executor executor, Handler handler)
      : call_([executor = std::move(executor), shared = std::make_shared<Handler>(std::move(handler))](
                  error_code error, std::size_t size) {
          asio::post(executor, [shared, error, size] { std::move (*shared)(error, size); });
        }) {}
  explicit operator bool() const { return static_cast<bool>(call_); }
  void operator()(error_code error, std::size_t size) { std::exchange(call_, nullptr)(error, size); }

 private:
  std::function<void(error_code, std::size_t)> call_;
};

/// Both directions of a connection, between the server's stream and a client.
struct Wire {
  std::mt19937_64 random;
  std::size_t window = 0;       // bytes that may be on their way to the client
  std::string arrived;          // at the server, and not read
  std::string on_its_way;       // to the client
  bool client_is_done = false;  // it sends no more
  bool is_reset = false;
  bool server_is_done = false;
  bool is_closed = false;  // by the server
  asio::mutable_buffer wanted;
  std::string offered;
  Completion reading, writing;

  [[nodiscard]] std::size_t up_to(std::size_t most) { return 1 + random() % most; }
  void serve() {
    if (reading) {
      if (is_closed) return reading(asio::error::operation_aborted, 0);
      if (is_reset) return reading(asio::error::connection_reset, 0);
      if (!arrived.empty()) {
        const std::size_t size = up_to(std::min(wanted.size(), arrived.size()));
        std::copy_n(arrived.begin(), size, static_cast<char*>(wanted.data()));
        arrived.erase(0, size);
        reading({}, size);
      } else if (client_is_done) {
        reading(asio::error::eof, 0);
      }
    }
    if (writing) {
      if (is_closed) return writing(asio::error::operation_aborted, 0);
      if (is_reset) return writing(asio::error::broken_pipe, 0);
      if (on_its_way.size() >= window) return;
      const std::size_t size = up_to(std::min(offered.size(), window - on_its_way.size()));
      on_its_way.append(offered, 0, size);
      writing({}, size);
    }
  }
};

class SimulatedStream {
 public:
  SimulatedStream(asio::any_io_executor executor, std::shared_ptr<Wire> wire)
      : executor_(std::move(executor)), wire_(std::move(wire)) {}

  [[nodiscard]] asio::any_io_executor get_executor() const { return executor_; }
  template <class Token>
  auto async_read_some(asio::mutable_buffer into, Token&& token) {
    return asio::async_initiate<Token, void(error_code, std::size_t)>(
        [this, into](auto handler) {
          wire_->wanted = into;
          wire_->reading = Completion(executor_, std::move(handler));
          wire_->serve();
        },
        token);
  }
  template <class Token>
  auto async_write_some(const std::vector<asio::const_buffer>& parts, Token&& token) {
    wire_->offered.clear();
    for (const asio::const_buffer& part : parts) {
      wire_->offered.append(static_cast<const char*>(part.data()), part.size());
    }
    return asio::async_initiate<Token, void(error_code, std::size_t)>(
        [this](auto handler) {
          wire_->writing = Completion(executor_, std::move(handler));
          wire_->serve();
        },
        token);
  }
  void cancel(error_code& /*error*/) {
    for (Completion* under_way : {&wire_->reading, &wire_->writing}) {
      if (*under_way) (*under_way)(asio::error::operation_aborted, 0);
    }
  }
  void shutdown(asio::socket_base::shutdown_type /*what*/, error_code& error) {
    wire_->server_is_done = true;
    if (wire_->is_reset) error = asio::error::not_connected;
  }
  void close(error_code& /*error*/) {
    wire_->is_closed = wire_->server_is_done = true;
    wire_->serve();
    wire_->serve();
  }

 private:
  asio::any_io_executor executor_;
  std::shared_ptr<Wire> wire_;
};

template <>
struct StreamTraits<SimulatedStream> {
  static constexpr bool joins_parts = false;
  static SimulatedStream& socket(SimulatedStream& stream) { return stream; }
  static asio::awaitable<base::Status> begin(SimulatedStream& /*stream*/) { co_return base::Status(); }
  static asio::awaitable<void> end(SimulatedStream& /*stream*/) { co_return; }
};

}  // namespace pneuma::net
