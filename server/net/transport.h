// A connection that carries whole messages: over TCP with length prefixes, or as a WebSocket; with or without TLS.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/system/error_code.hpp>

#include "base/status.h"
#include "net/server.h"

namespace pneuma::net {

namespace asio = boost::asio;

class Transport {
 public:
  virtual ~Transport() = default;

  /// Makes the connection ready for messages (the handshake of TLS). A broken connection is StatusCode::unavailable;
  /// plain bytes where TLS is wanted are unsupported, and what is written then goes out plain: a goodbye.
  virtual asio::awaitable<base::Status> open() = 0;
  /// The next whole message; none where the peer sends no more. `progressed` is told after each read whether it ended
  /// in the middle of a message. A broken connection is StatusCode::unavailable; bytes that cannot be a message, or end
  /// inside one, are malformed; one that there is no memory for is limit_exceeded.
  virtual asio::awaitable<base::Result<std::optional<ReceivedMessage>>> read(
      std::function<void(bool in_message)> progressed) = 0;
  /// Writes all of them; `progressed` after each part that the peer took, with its size. An error ends the connection.
  virtual asio::awaitable<boost::system::error_code> write(std::vector<SharedBytes> messages,
                                                           std::function<void(std::size_t bytes)> progressed) = 0;
  virtual void set_limit(std::size_t message_bytes_max) = 0;
  /// Ends the connection in its protocol's own way; abort() may interrupt it.
  virtual asio::awaitable<void> shut_down() = 0;
  /// Ends it at once; reads and writes under way fail.
  virtual void abort() = 0;
};

/// What a message that comes may take of the server's memory, while it comes.
class IncomingBytes {
 public:
  explicit IncomingBytes(const base::MemoryBudget& budget) : budget_(budget) {}

  /// The message so far takes so much; refused where there is no room for it.
  [[nodiscard]] base::Status hold(std::size_t bytes);
  /// The message is whole: what it takes goes along with it.
  [[nodiscard]] ReceivedMessage whole(std::string bytes);

 private:
  base::MemoryBudget budget_;
  base::MemoryBudget::Share share_;
};

/// TCP, with TLS where `tls` is given. Messages count in `memory` as they come.
[[nodiscard]] std::unique_ptr<Transport> make_stream_transport(asio::ip::tcp::socket socket, asio::ssl::context* tls,
                                                               std::size_t message_bytes_max,
                                                               const base::MemoryBudget& memory);

}  // namespace pneuma::net
