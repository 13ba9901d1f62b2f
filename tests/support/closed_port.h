// A port of this machine that refuses connections, and that no other program can take meanwhile.
#pragma once

#include <string>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace pneuma::support {

/// Bound, and never listened at.
class ClosedPort {
 public:
  ClosedPort() : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in name{};
    name.sin_family = AF_INET;
    name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(name);
    ::bind(socket_, reinterpret_cast<sockaddr*>(&name), size);
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&name), &size);
    address_ = std::string("127.0.0.1:").append(std::to_string(ntohs(name.sin_port)));
  }
  ~ClosedPort() { ::close(socket_); }
  ClosedPort(const ClosedPort&) = delete;
  ClosedPort& operator=(const ClosedPort&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  int socket_;
  std::string address_;
};

}  // namespace pneuma::support
