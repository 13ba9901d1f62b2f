// A net::Server with a trivial owner, and clients that are free to misbehave. Any wait ends after a minute, as a
// failure.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "net/server.h"

namespace pneuma::net {

constexpr std::size_t late_page_bytes = 16 * 1024 * 1024;  // more than goes at once

constexpr std::chrono::milliseconds pause_of_a_message{20};

/// A busy machine makes anyone slow: no time-out strikes but those that a test is about.
[[nodiscard]] base::Limits patient_limits();

/// Echoes each message; the first one authenticates. "end" closes the session; after "hold" it is read no further
/// until it is resumed, and after "pause" not for pause_of_a_message. Everything that it says by itself is text: "ping
/// NONCE", "goodbye REASON", "gap STREAM FROM TO". Over HTTP it has /hello, /file in two forms, and /late, which comes
/// when the time for its request is over.
class EchoServer {
 public:
  explicit EchoServer(const base::Limits& limits, const std::optional<Tls>& tls = std::nullopt);
  ~EchoServer();
  EchoServer(const EchoServer&) = delete;
  EchoServer& operator=(const EchoServer&) = delete;

  [[nodiscard]] Server& server() { return server_; }
  [[nodiscard]] std::uint16_t tcp_port() const;
  [[nodiscard]] std::uint16_t http_port() const;

  /// Waits until so many sessions were closed since the start, and gives the reasons in order.
  std::vector<base::Status> wait_closed(std::size_t count);
  /// Waits until so many sessions were opened, and gives their ids in order.
  std::vector<SessionId> wait_opened(std::size_t count);
  /// What the owner was told after a session was closed, or of one that never opened: always none.
  [[nodiscard]] int calls_out_of_order();
  [[nodiscard]] std::size_t keys_wanted();
  /// Messages received of an open session.
  [[nodiscard]] int received(SessionId id);
  /// Stops the server and waits until it has.
  void stop();

 private:
  Callbacks callbacks();
  void check_open(SessionId id);

  const std::chrono::milliseconds late_after_;
  Server server_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<SessionId> opened_;
  std::vector<base::Status> closed_;
  std::map<SessionId, int> open_;  // messages received of each
  int calls_out_of_order_ = 0;
  std::size_t keys_wanted_ = 0;
  std::thread thread_;
};

/// The message with its length in front.
[[nodiscard]] std::string framed(std::string_view message);

/// A blocking TCP connection that sends whatever bytes it is told to.
class RawClient {
 public:
  /// `receive_buffer_bytes` 0: the system's choice. From 127.0.0.`host`: another host is another client.
  explicit RawClient(std::uint16_t port, int receive_buffer_bytes = 0, std::uint8_t host = 1);
  ~RawClient();
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  /// False where the connection does not take them any more.
  bool send_bytes(std::string_view bytes);
  bool send_message(std::string_view message);
  /// None where the connection ended before.
  std::optional<std::string> read_bytes(std::size_t count);
  std::optional<std::string> read_message();
  /// Up to the end of the connection.
  std::string read_rest();
  void shut_down_sending();
  /// Closes with a reset instead of an orderly end.
  void reset();

 private:
  int socket_;
};

/// Hello and its echo: the session is authenticated.
[[nodiscard]] bool say_hello(RawClient& client);

}  // namespace pneuma::net
