#include "faults/net_rig.h"

#include <cerrno>
#include <chrono>
#include <utility>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

namespace pneuma::net {

using namespace std::chrono_literals;

namespace {

constexpr std::chrono::seconds wait_max{60};

SharedBytes share(std::string text) {
  return std::make_shared<const std::string>(std::move(text));
}

std::uint16_t port_of(const std::string& address) {
  return static_cast<std::uint16_t>(std::stoul(address.substr(address.rfind(':') + 1)));
}

}  // namespace

base::Limits patient_limits() {
  base::Limits limits;
  limits.message_bytes_max = 64 * 1024;
  limits.hello_timeout = 600s;
  limits.partial_message_timeout = 600s;
  limits.ping_interval = 600s;
  limits.write_stall_timeout = 600s;
  limits.output_queue_bytes_max = 1024 * 1024;
  limits.drain_timeout = 200ms;
  return limits;
}

EchoServer::EchoServer(const base::Limits& limits, const std::optional<Tls>& tls)
    : late_after_(limits.partial_message_timeout + std::chrono::milliseconds(100)), server_(limits, callbacks()) {
  const base::Status tcp = server_.listen_tcp("127.0.0.1:0", tls);
  const base::Status http = server_.listen_http("127.0.0.1:0", tls);
  EXPECT_TRUE(tcp.ok()) << tcp.message();
  EXPECT_TRUE(http.ok()) << http.message();
  thread_ = std::thread([this] { server_.run(); });
}

EchoServer::~EchoServer() {
  stop();
}

std::uint16_t EchoServer::tcp_port() const {
  return port_of(server_.tcp_address());
}
std::uint16_t EchoServer::http_port() const {
  return port_of(server_.http_address());
}

void EchoServer::stop() {
  if (!thread_.joinable()) return;
  server_.stop({base::StatusCode::unavailable, "stopping"});
  thread_.join();
}

Callbacks EchoServer::callbacks() {
  Callbacks callbacks;
  callbacks.opened = [this](SessionId id, const PeerInfo&) {
    const std::scoped_lock lock(mutex_);
    if (!opened_.empty() && id <= opened_.back()) ++calls_out_of_order_;
    opened_.push_back(id);
    open_[id] = 0;
    changed_.notify_all();
  };
  callbacks.received = [this](SessionId id, ReceivedMessage received) {
    const std::string& message = received.bytes;
    check_open(id);
    {
      const std::scoped_lock lock(mutex_);
      if (open_[id]++ == 0) server_.authenticated(id);
    }
    if (message == "hold") server_.hold(id);
    if (message == "pause") server_.pause_reading(id, pause_of_a_message);
    if (message == "end") return server_.close(id, {base::StatusCode::malformed, "as asked"});
    server_.send(id, share(message));
  };
  callbacks.closed = [this](SessionId id, const base::Status& why) {
    check_open(id);
    const std::scoped_lock lock(mutex_);
    open_.erase(id);
    closed_.push_back(why);
    changed_.notify_all();
  };
  callbacks.key_wanted = [this](SessionId id, std::uint32_t) {
    check_open(id);
    const std::scoped_lock lock(mutex_);
    ++keys_wanted_;
  };
  callbacks.http = [this](const PageRequest& request) {
    const std::string_view path = request.path;
    if (path == "/late") {
      std::this_thread::sleep_for(late_after_);
      return text_reply(200, std::string(late_page_bytes, 'x'));
    }
    if (path == "/file") return HttpReply{200, "text/plain", share("as it is"), share("compressed"), "\"tag\""};
    return path == "/hello" ? text_reply(200, "world") : text_reply(404, "nothing");
  };
  callbacks.make_ping = [](std::uint64_t nonce) { return "ping " + std::to_string(nonce); };
  callbacks.make_goodbye = [](const base::Status& why) { return "goodbye " + why.message(); };
  callbacks.make_gap = [](std::uint32_t stream, std::uint64_t from, std::uint64_t to) {
    return "gap " + std::to_string(stream) + " " + std::to_string(from) + " " + std::to_string(to);
  };
  return callbacks;
}

void EchoServer::check_open(SessionId id) {
  const std::scoped_lock lock(mutex_);
  if (!open_.contains(id)) ++calls_out_of_order_;
}

std::vector<base::Status> EchoServer::wait_closed(std::size_t count) {
  std::unique_lock lock(mutex_);
  EXPECT_TRUE(changed_.wait_for(lock, wait_max, [&] { return closed_.size() >= count; }));
  return closed_;
}

std::vector<SessionId> EchoServer::wait_opened(std::size_t count) {
  std::unique_lock lock(mutex_);
  EXPECT_TRUE(changed_.wait_for(lock, wait_max, [&] { return opened_.size() >= count; }));
  return opened_;
}

int EchoServer::calls_out_of_order() {
  const std::scoped_lock lock(mutex_);
  return calls_out_of_order_;
}

std::size_t EchoServer::keys_wanted() {
  const std::scoped_lock lock(mutex_);
  return keys_wanted_;
}

int EchoServer::received(SessionId id) {
  const std::scoped_lock lock(mutex_);
  return open_.at(id);
}

std::string framed(std::string_view message) {
  const std::uint32_t length = htonl(static_cast<std::uint32_t>(message.size()));
  std::string bytes(reinterpret_cast<const char*>(&length), sizeof length);
  bytes.append(message);
  return bytes;
}

RawClient::RawClient(std::uint16_t port, int receive_buffer_bytes, std::uint8_t host)
    : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
  if (receive_buffer_bytes > 0) {
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
  }
  const timeval patience{.tv_sec = wait_max.count(), .tv_usec = 0};
  ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK - 1 + host);
  EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
}

RawClient::~RawClient() {
  if (socket_ >= 0) ::close(socket_);
}

bool RawClient::send_bytes(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

bool RawClient::send_message(std::string_view message) {
  return send_bytes(framed(message));
}

std::optional<std::string> RawClient::read_bytes(std::size_t count) {
  std::string bytes(count, '\0');
  for (std::size_t at = 0; at < count;) {
    const ssize_t got = ::recv(socket_, bytes.data() + at, count - at, 0);
    EXPECT_FALSE(got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) << "nothing came in time";
    if (got <= 0) return std::nullopt;
    at += static_cast<std::size_t>(got);
  }
  return bytes;
}

std::optional<std::string> RawClient::read_message() {
  const auto prefix = read_bytes(4);
  if (!prefix) return std::nullopt;
  std::uint32_t length = 0;
  for (const char byte : *prefix) length = (length << 8U) | static_cast<unsigned char>(byte);
  return read_bytes(length);
}

std::string RawClient::read_rest() {
  std::string rest;
  while (auto byte = read_bytes(1)) rest += *byte;
  return rest;
}

void RawClient::shut_down_sending() {
  ::shutdown(socket_, SHUT_WR);
}

void RawClient::reset() {
  const linger at_once{.l_onoff = 1, .l_linger = 0};
  ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  ::close(std::exchange(socket_, -1));
}

bool say_hello(RawClient& client) {
  return client.send_message("hello") && client.read_message() == "hello";
}

}  // namespace pneuma::net
