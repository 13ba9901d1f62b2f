// Whole messages over one TCP or TLS connection, with a deadline on every wait.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <string>

#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>

#include "base/status.h"

namespace pneuma::client {

using Deadline = std::chrono::steady_clock::time_point;

// A key frame or the scene of the largest world, with room; a longer length is no message of ours.
inline constexpr std::size_t received_message_bytes_max = std::size_t{64} * 1024 * 1024;

/// Used by one thread. What was received before a failure can still be taken; after that, the failure.
class Connection {
 public:
  Connection() = default;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// `ca_file` is PEM; empty: the system's certificates.
  [[nodiscard]] base::Status open(const std::string& host, const std::string& port, bool tls,
                                  const std::string& ca_file, Deadline deadline);
  /// Queues a message; it leaves while the connection waits for something.
  void queue(const std::string& message);
  /// Waits until all that is queued has left. A deadline passed in the middle breaks the connection.
  [[nodiscard]] base::Status flush(Deadline deadline);
  /// The next whole message, or nothing when the deadline passes first.
  [[nodiscard]] base::Result<std::optional<std::string>> receive(Deadline deadline);

 private:
  using Socket = boost::asio::ip::tcp::socket;

  [[nodiscard]] base::Status start_tls(const std::string& host, const std::string& ca_file, Deadline deadline);
  /// Starts an operation and waits for its end.
  [[nodiscard]] boost::system::error_code await(
      const std::function<void(std::function<void(boost::system::error_code)>)>& start, Deadline deadline);
  /// Lets operations go on until `done` holds; false when it is too late for that.
  bool run_until(Deadline deadline, const std::function<bool()>& done);
  void read_some();
  void write_next();
  void fail(const std::string& action, boost::system::error_code error);
  [[nodiscard]] std::optional<std::string> take_message();

  boost::asio::io_context io_{1};
  Socket socket_{io_};
  std::optional<boost::asio::ssl::context> tls_context_;
  std::optional<boost::asio::ssl::stream<Socket&>> tls_;
  std::array<char, 65536> chunk_{};
  std::string input_;
  std::size_t input_taken_ = 0;
  bool has_received_ = false;  // anything at all
  std::deque<std::string> output_;
  base::Status failure_;
};

}  // namespace pneuma::client
