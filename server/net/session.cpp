#include "net/session.h"

#include <algorithm>
#include <exception>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace pneuma::net {

namespace {

using boost::system::error_code;

// A write takes about this much: enough to keep a socket busy, little enough to keep frames droppable.
constexpr std::size_t write_bytes = 16 * 1024;

// Of replies that wait: past it no further message is read.
constexpr std::size_t unread_replies_bytes_max = 256 * 1024;

// Time limits are looked at this often: four times in the shortest of them, but no oftener than a busy server can bear.
constexpr std::chrono::milliseconds time_resolution_max{250};
constexpr std::chrono::milliseconds time_resolution_min{5};

// For the client to take its goodbye out of the socket and close; a close with bytes unread would reset the connection
// under it.
constexpr std::chrono::milliseconds linger_timeout{1'000};

// Of one session, where they lie ready: then others have their turn.
constexpr int messages_in_a_row = 16;

// Soon enough to act within a second of trouble, rarely enough that it costs nothing.
constexpr std::chrono::milliseconds report_interval{250};

std::chrono::milliseconds time_resolution(const base::Limits& limits) {
  const auto shortest = std::min(
      {limits.hello_timeout, limits.partial_message_timeout, limits.ping_interval, limits.write_stall_timeout});
  return std::clamp(shortest / 4, time_resolution_min, time_resolution_max);
}

}  // namespace

Session::Session(SessionId id, PeerInfo peer, std::unique_ptr<Transport> transport, const base::Limits& limits,
                 const Callbacks& callbacks, Clock& clock, asio::any_io_executor executor,
                 std::function<void(SessionId)> ended)
    : id_(id),
      peer_(std::move(peer)),
      transport_(std::move(transport)),
      limits_(limits),
      callbacks_(callbacks),
      clock_(clock),
      ended_(std::move(ended)),
      queue_(limits.output_queue_bytes_max, callbacks.make_gap),
      timers_(limits, now()),
      writer_wake_(executor, asio::steady_timer::time_point::max()),
      reader_wake_(executor, asio::steady_timer::time_point::max()),
      time_keeper_(executor) {}

void Session::start() {
  spawn(&Session::open);
  spawn(&Session::keep_time);
}

void Session::refuse(const base::Status& why) {
  close(why);
  timers_.closing_until(now() + limits_.hello_timeout);
  start();
}

// Each coroutine keeps the session alive until it is through; one that fails takes the session along.
void Session::spawn(asio::awaitable<void> (Session::*coroutine)()) {
  asio::co_spawn(time_keeper_.get_executor(), (this->*coroutine)(),
                 [self = shared_from_this()](const std::exception_ptr& failure) {
                   if (failure) self->abort();
                 });
}

void Session::send(SharedBytes message) {
  if (closing_ || over_) return;
  if (!queue_.push_reply(std::move(message))) {
    return close({base::StatusCode::limit_exceeded, "more replies wait than the output queue holds"});
  }
  wake_writer();
}

void Session::offer(const StreamFrame& frame, bool memory_is_full) {
  if (closing_ || over_) return;
  queue_.set_memory_full(memory_is_full);
  queue_.offer(frame, now());
  ask_for_keys();
  tell_flow(frame.stream_id);
  report_readers();
  wake_writer();
}

void Session::end_stream(std::uint32_t stream_id) {
  queue_.end_stream(stream_id);
  reported_.erase(stream_id);
}

void Session::report_readers() {
  if (reported_.empty()) return;
  const TimePoint time = now();
  if (time - last_report_ < report_interval) return;
  last_report_ = time;
  for (const StreamStats& stream : queue_.stream_stats(time)) {
    if (reported_.contains(stream.stream_id)) callbacks_.reader_report(id_, {time, drain_.bytes_s(time), stream});
  }
}

// One that stalled and has a frame again says so by asking for a key, which it needs no more.
void Session::tell_flow(std::uint32_t stream_id) {
  const OutputQueue::Flow flow = queue_.change_of_flow(stream_id);
  if (flow == OutputQueue::Flow::stalled && callbacks_.stream_stalled) callbacks_.stream_stalled(id_, stream_id);
  if (flow == OutputQueue::Flow::resumed) callbacks_.key_wanted(id_, stream_id);
}

void Session::ask_for_keys() {
  if (closing_ || over_) return;
  for (const std::uint32_t stream_id : queue_.keys_to_ask_for()) callbacks_.key_wanted(id_, stream_id);
}

void Session::authenticated() {
  timers_.authenticated(now());
  transport_->set_limit(limits_.message_bytes_max);
}

void Session::resume() {
  held_ = false;
  reader_wake_.cancel();
}

void Session::stop_reading() {
  reading_ = false;
  reader_wake_.cancel();
}

void Session::close(const base::Status& why) {
  if (closing_ || over_) return;
  closing_ = true;
  stop_reading();
  timers_.closing_until(now() + limits_.write_stall_timeout);
  queue_.push_goodbye(std::make_shared<const std::string>(callbacks_.make_goodbye(why)));
  wake_writer();
  say_closed(why);
}

void Session::abort() {
  if (std::exchange(over_, true)) return;
  stop_reading();
  transport_->abort();
  queue_.clear();
  wake_writer();
  time_keeper_.cancel();
  say_closed({base::StatusCode::unavailable, "the connection broke"});
  ended_(id_);
}

void Session::say_closed(const base::Status& why) {
  if (std::exchange(opened_, false)) callbacks_.closed(id_, why);
}

SessionStats Session::stats() const {
  return {queue_.bytes(), queue_.totals(), queue_.ages(), bytes_sent_, bytes_received_};
}

ReaderStats Session::reader_stats() const {
  const TimePoint time = now();
  return {time, drain_.bytes_s(time), queue_.stream_stats(time)};
}

asio::awaitable<void> Session::open() {
  const base::Status opened = co_await transport_->open();
  const bool can_be_told = opened.ok() || opened.code() == base::StatusCode::unsupported;
  if (!can_be_told) abort();
  if (over_) co_return;
  if (!closing_) {
    opened_ = true;
    callbacks_.opened(id_, peer_);
    if (opened.ok()) {
      spawn(&Session::read_messages);
    } else {
      close(opened);
    }
  }
  spawn(&Session::write_queue);
}

asio::awaitable<void> Session::read_messages() {
  for (int in_a_row = 1; reading_; ++in_a_row) {
    if (in_a_row % messages_in_a_row == 0) co_await asio::post(reader_wake_.get_executor(), asio::use_awaitable);
    if (!reading_) break;
    auto message = co_await transport_->read([this](bool in_message) { timers_.received(now(), in_message); });
    if (!reading_) break;
    if (!message.ok()) {
      close(message.status());
      if (message.status().code() == base::StatusCode::unavailable) abort();
    } else if (!*message) {
      say_closed({});  // by the client; it may still read
      close({base::StatusCode::unavailable, "the client sends no more"});
    } else {
      bytes_received_ += (*message)->bytes.size();
      callbacks_.received(id_, std::move(**message));
      if (!may_read()) co_await await_turn_to_read();
    }
  }
}

// A client that sends faster than it reads its replies is not read either: what it sends waits in its own socket.
bool Session::may_read() const {
  return !held_ && now() >= paused_until_ && queue_.reply_bytes() < unread_replies_bytes_max;
}

asio::awaitable<void> Session::await_turn_to_read() {
  timers_.reading_paused();
  while (reading_ && !may_read()) {
    const TimePoint time = now();
    if (paused_until_ > time) {
      clock_.set(reader_wake_, paused_until_ - time);
    } else {
      reader_wake_.expires_at(asio::steady_timer::time_point::max());
    }
    error_code woken;
    co_await reader_wake_.async_wait(asio::redirect_error(asio::use_awaitable, woken));
  }
  timers_.reading_resumed(now());
}

asio::awaitable<void> Session::write_queue() {
  while (!over_) {
    if (queue_.empty()) {
      if (closing_) break;
      error_code woken;
      co_await writer_wake_.async_wait(asio::redirect_error(asio::use_awaitable, woken));
      continue;
    }
    std::vector<SharedBytes> messages = queue_.take(write_bytes, now());
    for (const SharedBytes& message : messages) bytes_sent_ += message->size();
    timers_.write_progressed(now());
    const error_code error = co_await transport_->write(std::move(messages), [this](std::size_t bytes) {
      const TimePoint time = now();
      timers_.write_progressed(time);
      drain_.add(time, bytes);
    });
    timers_.write_done();
    queue_.written();
    if (may_read()) reader_wake_.cancel();
    if (error) break;
    queue_.set_memory_full(false);  // a key that finds it full all the same says so
    ask_for_keys();
  }
  if (!over_ && closing_) {
    timers_.closing_until(now() + linger_timeout);
    co_await transport_->shut_down();
  }
  abort();
}

asio::awaitable<void> Session::keep_time() {
  while (!over_) {
    const SessionTimers::Action action = timers_.poll(now());
    if (const auto* ping = std::get_if<SessionTimers::SendPing>(&action)) {
      send(std::make_shared<const std::string>(callbacks_.make_ping(ping->nonce)));
    } else if (const auto* why = std::get_if<base::Status>(&action)) {
      const bool can_say_goodbye = opened_ && !closing_ && !timers_.is_writing();
      close(*why);
      if (!can_say_goodbye) abort();
      if (over_) break;
    }
    clock_.set(time_keeper_, time_resolution(limits_));
    error_code woken;
    co_await time_keeper_.async_wait(asio::redirect_error(asio::use_awaitable, woken));
  }
}

}  // namespace pneuma::net
