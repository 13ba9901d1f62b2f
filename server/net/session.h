// One client: reads its messages, writes its queue, keeps its time limits. Lives on the network thread.
#pragma once

#include <functional>
#include <memory>
#include <set>

#include <boost/asio/steady_timer.hpp>

#include "net/clock.h"
#include "net/output_queue.h"
#include "net/session_timers.h"
#include "net/transport.h"

namespace pneuma::net {

class Session : public std::enable_shared_from_this<Session> {
 public:
  /// `ended` is called once, when the connection is gone; `callbacks`, `clock` and what is captured live longer than
  /// the session.
  Session(SessionId id, PeerInfo peer, std::unique_ptr<Transport> transport, const base::Limits& limits,
          const Callbacks& callbacks, Clock& clock, asio::any_io_executor executor,
          std::function<void(SessionId)> ended);

  void start();
  /// Only says goodbye: its owner never hears of it. Instead of start().
  void refuse(const base::Status& why);
  void send(SharedBytes message);
  /// `memory_is_full`: there is no room in memory for what waits, whoever for.
  void offer(const StreamFrame& frame, bool memory_is_full);
  void report_on(std::uint32_t stream_id) { reported_.insert(stream_id); }
  void end_stream(std::uint32_t stream_id);
  void authenticated();
  void pong(std::uint64_t nonce) { timers_.pong(nonce); }
  /// Reads no further message until resume().
  void hold() { held_ = true; }
  void resume();
  /// Reads no further message for so long.
  void pause_reading(Clock::Duration pause) { paused_until_ = now() + pause; }
  /// Takes no more messages.
  void stop_reading();
  /// Takes no more messages; writes what is queued and a goodbye, then ends. The first reason counts.
  void close(const base::Status& why);
  /// Ends now.
  void abort();

  [[nodiscard]] bool closing() const { return closing_; }
  /// As what it takes is counted.
  [[nodiscard]] const std::string& client() const { return peer_.counted_as; }
  /// Of the replies that the client has not taken.
  [[nodiscard]] std::size_t unread_reply_bytes() const { return queue_.unread_reply_bytes(); }
  [[nodiscard]] SessionStats stats() const;
  [[nodiscard]] ReaderStats reader_stats() const;

 private:
  void spawn(asio::awaitable<void> (Session::*coroutine)());
  void say_closed(const base::Status& why);
  void ask_for_keys();
  void tell_flow(std::uint32_t stream_id);
  void report_readers();
  asio::awaitable<void> open();
  asio::awaitable<void> read_messages();
  asio::awaitable<void> await_turn_to_read();
  [[nodiscard]] bool may_read() const;
  asio::awaitable<void> write_queue();
  asio::awaitable<void> keep_time();
  void wake_writer() { writer_wake_.cancel(); }
  [[nodiscard]] TimePoint now() const { return clock_.now(); }

  SessionId id_;
  PeerInfo peer_;
  std::unique_ptr<Transport> transport_;
  base::Limits limits_;
  const Callbacks& callbacks_;
  Clock& clock_;
  std::function<void(SessionId)> ended_;
  OutputQueue queue_;
  DrainMeter drain_;
  std::set<std::uint32_t> reported_;  // streams
  TimePoint last_report_{};
  SessionTimers timers_;
  asio::steady_timer writer_wake_;
  asio::steady_timer reader_wake_;
  asio::steady_timer time_keeper_;
  bool opened_ = false;  // the owner was told, and not yet of its end
  bool reading_ = true;
  bool held_ = false;  // by the owner
  TimePoint paused_until_{};
  bool closing_ = false;
  bool over_ = false;
  std::uint64_t bytes_sent_ = 0;
  std::uint64_t bytes_received_ = 0;
};

}  // namespace pneuma::net
