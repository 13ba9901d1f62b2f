// A bare TCP connection, for what no good client sends. Reads are bounded in time.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "pneuma/v1/session.pb.h"

namespace pneuma::integration {

class RawConnection {
 public:
  /// `receive_buffer_bytes` 0: the system's choice; small: a reader that is soon full.
  explicit RawConnection(const std::string& address, int receive_buffer_bytes = 0);
  ~RawConnection();
  RawConnection(const RawConnection&) = delete;
  RawConnection& operator=(const RawConnection&) = delete;

  /// From now on it takes no more than this: a slow reader, or a slow line.
  void read_at(double bytes_s);

  /// False where the other side is gone.
  bool send(std::string_view bytes);
  bool send(const v1::ClientMessage& message) { return send(envelope(message.SerializeAsString())); }
  /// Sends what the other side takes within `time`; false where that is not all.
  bool send_for(std::string_view bytes, std::chrono::milliseconds time);
  /// The next message; nothing where the connection ended, or none came in time.
  std::optional<v1::ServerMessage> receive();
  /// The next message that answers `request_id`.
  std::optional<v1::ServerMessage> receive_reply(std::uint64_t request_id);
  /// Sends a request and waits for its reply.
  std::optional<v1::ServerMessage> ask(std::uint64_t request_id, v1::ClientMessage message);
  /// All bytes that come until the connection ends, or none does in time.
  std::string receive_to_end();
  /// True where the server ends the connection in time; what comes before is thrown away, the last goodbye's code kept.
  bool ends();
  [[nodiscard]] v1::Error::Code goodbye() const { return goodbye_; }

  /// Says hello and takes the welcome.
  bool say_hello(const std::string& token = {});

  [[nodiscard]] static std::string envelope(std::string_view message);
  /// So many ListWorlds in one go, of ids from `first_id` on.
  [[nodiscard]] static std::string lists(std::uint64_t first_id, std::uint64_t count);

 private:
  bool read(char* out, std::size_t count);

  int socket_ = -1;
  double bytes_s_ = 0.0;  // 0: as they come
  std::chrono::steady_clock::time_point next_read_;
  v1::Error::Code goodbye_ = v1::Error::CODE_UNSPECIFIED;
};

}  // namespace pneuma::integration
