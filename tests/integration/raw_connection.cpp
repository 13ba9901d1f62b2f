#include "raw_connection.h"

#include <algorithm>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace pneuma::integration {

namespace {

constexpr int patience_ms = 60'000;
constexpr std::uint32_t message_bytes_max = 64U << 20U;
// Of a slow reader, at once.
constexpr std::size_t slow_read_bytes = 2'048;

}  // namespace

RawConnection::RawConnection(const std::string& address, int receive_buffer_bytes) {
  const auto colon = address.rfind(':');
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
  inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr);
  socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (receive_buffer_bytes > 0) {
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof(receive_buffer_bytes));
  }
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) != 0) {
    close(socket_);
    socket_ = -1;
  }
}

void RawConnection::read_at(double bytes_s) {
  bytes_s_ = bytes_s;
  next_read_ = std::chrono::steady_clock::now();
}

RawConnection::~RawConnection() {
  if (socket_ >= 0) close(socket_);
}

bool RawConnection::send(std::string_view bytes) {
  while (!bytes.empty()) {
    pollfd ready{socket_, POLLOUT, 0};
    if (poll(&ready, 1, patience_ms) != 1) return false;
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

bool RawConnection::send_for(std::string_view bytes, std::chrono::milliseconds time) {
  const auto deadline = std::chrono::steady_clock::now() + time;
  while (!bytes.empty()) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    pollfd ready{socket_, POLLOUT, 0};
    if (left.count() <= 0 || poll(&ready, 1, static_cast<int>(left.count())) != 1) return false;
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

bool RawConnection::read(char* out, std::size_t count) {
  while (count > 0) {
    if (bytes_s_ > 0.0) std::this_thread::sleep_until(next_read_);
    pollfd ready{socket_, POLLIN, 0};
    if (poll(&ready, 1, patience_ms) != 1) return false;
    const ssize_t got = recv(socket_, out, bytes_s_ > 0.0 ? std::min(count, slow_read_bytes) : count, 0);
    if (got <= 0) return false;
    if (bytes_s_ > 0.0) {
      const std::chrono::duration<double> taken(static_cast<double>(got) / bytes_s_);
      next_read_ += std::chrono::duration_cast<std::chrono::nanoseconds>(taken);
    }
    out += got;
    count -= static_cast<std::size_t>(got);
  }
  return true;
}

std::optional<v1::ServerMessage> RawConnection::receive() {
  std::uint32_t length = 0;
  if (!read(reinterpret_cast<char*>(&length), sizeof(length))) return std::nullopt;
  length = ntohl(length);
  if (length > message_bytes_max) return std::nullopt;
  std::string bytes(length, '\0');
  v1::ServerMessage message;
  if (!read(bytes.data(), length) || !message.ParseFromString(bytes)) return std::nullopt;
  if (message.has_goodbye()) goodbye_ = message.goodbye().reason().code();
  return message;
}

std::optional<v1::ServerMessage> RawConnection::receive_reply(std::uint64_t request_id) {
  while (auto message = receive()) {
    if (message->request_id() == request_id) return message;
  }
  return std::nullopt;
}

std::optional<v1::ServerMessage> RawConnection::ask(std::uint64_t request_id, v1::ClientMessage message) {
  message.set_request_id(request_id);
  return send(message) ? receive_reply(request_id) : std::nullopt;
}

std::string RawConnection::receive_to_end() {
  std::string bytes;
  for (char byte = 0; read(&byte, 1);) bytes += byte;
  return bytes;
}

bool RawConnection::ends() {
  while (receive()) {
  }
  pollfd ready{socket_, POLLIN, 0};
  if (poll(&ready, 1, 0) != 1) return false;
  char byte = 0;
  return recv(socket_, &byte, 1, MSG_DONTWAIT) <= 0;
}

bool RawConnection::say_hello(const std::string& token) {
  v1::ClientMessage hello;
  hello.set_request_id(1);
  hello.mutable_hello()->set_protocol_version(1);
  hello.mutable_hello()->set_token(token);
  if (!send(hello)) return false;
  const auto reply = receive_reply(1);
  return reply && reply->has_welcome();
}

std::string RawConnection::lists(std::uint64_t first_id, std::uint64_t count) {
  std::string bytes;
  for (std::uint64_t id = first_id; id < first_id + count; ++id) {
    v1::ClientMessage message;
    message.set_request_id(id);
    message.mutable_list_worlds();
    bytes += envelope(message.SerializeAsString());
  }
  return bytes;
}

std::string RawConnection::envelope(std::string_view message) {
  const std::uint32_t length = htonl(static_cast<std::uint32_t>(message.size()));
  std::string out(reinterpret_cast<const char*>(&length), sizeof(length));
  out += message;
  return out;
}

}  // namespace pneuma::integration
