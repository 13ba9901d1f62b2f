#include "bench/crowd.h"

#include <array>
#include <atomic>
#include <cstddef>
#include <mutex>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <sched.h>

#include "base/address.h"
#include "base/limits.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::bench {

namespace {

namespace asio = boost::asio;
using Tcp = asio::ip::tcp;

constexpr std::size_t length_prefix_bytes = 4;
// Of those that hardly read: they are full within a second.
constexpr int small_buffer_bytes = 4096;
constexpr std::chrono::seconds join_patience{30};

void append_envelope(const v1::ClientMessage& message, std::string& out) {
  const std::size_t size = message.ByteSizeLong();
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<char>((size >> shift) & 0xff));
  message.AppendToString(&out);
}

std::size_t length_at(const char* bytes) {
  std::size_t length = 0;
  for (std::size_t i = 0; i < length_prefix_bytes; ++i) length = length << 8 | static_cast<unsigned char>(bytes[i]);
  return length;
}

// Hello and subscribe.
std::string greeting_for(const Crowd::Watched& watched) {
  std::string greeting;
  v1::ClientMessage hello;
  hello.set_request_id(1);
  hello.mutable_hello()->set_protocol_version(base::protocol_version);
  append_envelope(hello, greeting);
  v1::ClientMessage subscribe;
  subscribe.set_request_id(2);
  subscribe.mutable_subscribe()->set_world(watched.world);
  subscribe.mutable_subscribe()->set_rate_hz(watched.rate_hz);
  subscribe.mutable_subscribe()->set_max_error_m(watched.max_error_m);
  append_envelope(subscribe, greeting);
  return greeting;
}

}  // namespace

struct Crowd::Impl {
  asio::awaitable<void> attend(Pace pace, std::string greeting, std::size_t group);
  asio::awaitable<void> read_promptly(Tcp::socket& socket, std::size_t group);
  asio::awaitable<void> read_slowly(Tcp::socket& socket);
  asio::awaitable<void> read_nothing();
  void fail(const std::string& what);

  std::string host;
  std::string port;
  asio::io_context io{1};
  asio::executor_work_guard<asio::io_context::executor_type> work{io.get_executor()};
  v1::ServerMessage message;  // kept for its memory
  std::vector<Arrival> arrivals;
  std::size_t groups = 0;
  std::atomic<std::size_t> present = 0;
  std::mutex mutex;
  std::string failure;
  std::jthread thread;
};

Crowd::Crowd(const std::string& address) : impl_(std::make_unique<Impl>()) {
  if (const auto parsed = base::parse_address(address); parsed.ok()) {
    impl_->host = parsed->host;
    impl_->port = parsed->port;
  }
  impl_->thread = std::jthread([impl = impl_.get()] { impl->io.run(); });
}

Crowd::~Crowd() {
  impl_->io.stop();
}

base::Status Crowd::add(Pace pace, std::size_t count, const Watched& watched) {
  const std::size_t wanted = impl_->present + count;
  const std::size_t group = impl_->groups++;
  for (std::size_t i = 0; i < count; ++i) {
    asio::co_spawn(impl_->io, impl_->attend(pace, greeting_for(watched), group), asio::detached);
  }
  const auto deadline = Clock::now() + join_patience;
  const auto failed = [this] {
    const std::scoped_lock lock(impl_->mutex);
    return !impl_->failure.empty();
  };
  while (impl_->present < wanted && !failed() && Clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  const std::scoped_lock lock(impl_->mutex);
  if (!impl_->failure.empty()) return {base::StatusCode::unavailable, impl_->failure};
  if (impl_->present < wanted) return {base::StatusCode::unavailable, "not all of the crowd got in"};
  return {};
}

base::Result<std::vector<Crowd::Arrival>> Crowd::leave() {
  impl_->io.stop();
  impl_->thread.join();
  if (!impl_->failure.empty()) return base::Status(base::StatusCode::unavailable, impl_->failure);
  return std::move(impl_->arrivals);
}

void Crowd::Impl::fail(const std::string& what) {
  const std::scoped_lock lock(mutex);
  failure = what;
}

asio::awaitable<void> Crowd::Impl::attend(Pace pace, std::string greeting, std::size_t group) {
  try {
    const auto found = co_await Tcp::resolver(io).async_resolve(host, port, asio::use_awaitable);
    Tcp::socket socket(io);
    socket.open(found.begin()->endpoint().protocol());
    if (pace != Pace::prompt) socket.set_option(asio::socket_base::receive_buffer_size(small_buffer_bytes));
    co_await socket.async_connect(found.begin()->endpoint(), asio::use_awaitable);
    co_await asio::async_write(socket, asio::buffer(greeting), asio::use_awaitable);
    if (pace == Pace::prompt) {
      co_await read_promptly(socket, group);
    } else {
      ++present;
      if (pace == Pace::byte_a_second) co_await read_slowly(socket);
      co_await read_nothing();
    }
  } catch (const std::exception& error) {
    fail(error.what());
  }
}

asio::awaitable<void> Crowd::Impl::read_promptly(Tcp::socket& socket, std::size_t group) {
  std::array<char, 16 * 1024> buffer;
  std::string unread;
  bool seen_a_frame = false;
  while (true) {
    const std::size_t size = co_await socket.async_read_some(asio::buffer(buffer), asio::use_awaitable);
    unread.append(buffer.data(), size);
    std::string_view rest = unread;
    while (rest.size() >= length_prefix_bytes && rest.size() - length_prefix_bytes >= length_at(rest.data())) {
      const std::size_t length = length_at(rest.data());
      if (!message.ParseFromArray(rest.data() + length_prefix_bytes, static_cast<int>(length))) {
        co_return fail("the server sent what is no message");
      }
      rest.remove_prefix(length_prefix_bytes + length);
      if (message.has_error() || message.has_goodbye()) co_return fail(message.ShortDebugString());
      if (!message.has_frame()) continue;
      arrivals.push_back({message.frame().tick(), Clock::now(), group});
      if (!std::exchange(seen_a_frame, true)) ++present;
    }
    unread.erase(0, unread.size() - rest.size());
  }
}

asio::awaitable<void> Crowd::Impl::read_slowly(Tcp::socket& socket) {
  asio::steady_timer timer(io);
  char byte = 0;
  while (true) {
    timer.expires_after(std::chrono::seconds(1));
    co_await timer.async_wait(asio::use_awaitable);
    co_await socket.async_read_some(asio::buffer(&byte, 1), asio::use_awaitable);
  }
}

asio::awaitable<void> Crowd::Impl::read_nothing() {
  asio::steady_timer timer(io, Clock::time_point::max());
  co_await timer.async_wait(asio::use_awaitable);
}

OnCore::OnCore(std::size_t core) {
  cpu_set_t set;
  CPU_ZERO(&set);
  sched_getaffinity(0, sizeof set, &set);
  for (std::size_t i = 0; i < CPU_SETSIZE; ++i) {
    if (CPU_ISSET(i, &set)) before_.push_back(i);
  }
  CPU_ZERO(&set);
  CPU_SET(before_.at(core), &set);
  if (sched_setaffinity(0, sizeof set, &set) != 0) throw std::runtime_error("a thread cannot be put on a core");
}

OnCore::~OnCore() {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const std::size_t core : before_) CPU_SET(core, &set);
  sched_setaffinity(0, sizeof set, &set);
}

}  // namespace pneuma::bench
