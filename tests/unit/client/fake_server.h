// A server of one connection that does what a test's script says, good or bad. On loopback, bounded in time.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "pneuma/v1/session.pb.h"

namespace pneuma::client {

/// Nothing takes this long unless it hangs.
inline constexpr std::chrono::seconds long_enough{60};

/// The server's end of the connection, for the script.
class FakeSession {
 public:
  explicit FakeSession(int socket) : socket_(socket) {}

  /// The client's next message; nothing when it closes. A failure of the test when none comes in time.
  std::optional<v1::ClientMessage> receive();
  void send(const v1::ServerMessage& message);
  void send_bytes(const std::string& bytes);
  /// Takes the hello and welcomes the client.
  v1::Hello welcome(std::uint32_t message_bytes_max = 1024 * 1024, std::uint32_t parts_bytes_max = 0);
  /// Answers the client's next message with what `fill` makes of it. False when it closes.
  bool reply(const std::function<void(const v1::ClientMessage&, v1::ServerMessage&)>& fill);
  /// Waits until the client closes, whatever it says before.
  void drain();

 private:
  bool read_exactly(char* bytes, std::size_t size);
  int socket_;
};

class FakeServer {
 public:
  using Script = std::function<void(FakeSession&)>;

  /// Takes one connection, runs `script` on it and closes it.
  explicit FakeServer(Script script);
  /// Waits for the script's end.
  ~FakeServer();
  FakeServer(const FakeServer&) = delete;
  FakeServer& operator=(const FakeServer&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  int listener_ = -1;
  std::string address_;
  std::thread thread_;
};

[[nodiscard]] std::string framed(const std::string& message);

// Messages of a world "w" with one body "ball", a tetrahedron, and one solid "floor", on a grid of 1 mm.
[[nodiscard]] v1::ServerMessage topology_message();
[[nodiscard]] v1::ServerMessage layout_message(std::uint32_t stream_id, std::uint32_t layout_id = 1);
/// Every vertex `offset` grid steps from where it is at 0.
[[nodiscard]] v1::ServerMessage key_frame(std::uint32_t stream_id, std::uint64_t tick, std::int64_t offset = 0,
                                          std::uint32_t layout_id = 1);
[[nodiscard]] v1::ServerMessage delta_frame(std::uint32_t stream_id, std::uint64_t tick, std::uint64_t base_tick,
                                            std::int64_t offset, std::int64_t base_offset);
void fill_subscribed(std::uint32_t stream_id, v1::ServerMessage& message);

}  // namespace pneuma::client
