#include "connection.h"

#include <memory>
#include <string_view>
#include <utility>

namespace pneuma::client {

namespace asio = boost::asio;
using boost::system::error_code;

namespace {

constexpr std::size_t prefix_bytes = 4;

std::string with_length(const std::string& message) {
  std::string bytes;
  bytes.reserve(prefix_bytes + message.size());
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>((message.size() >> shift) & 0xffU));
  return bytes += message;
}

std::size_t length_at(const std::string& bytes, std::size_t offset) {
  std::size_t length = 0;
  for (std::size_t i = 0; i < prefix_bytes; ++i) length = (length << 8) | static_cast<unsigned char>(bytes[offset + i]);
  return length;
}

/// What a message of such a length is: where another protocol is spoken, its first bytes are no length that we take.
std::string no_message(const std::string& bytes, std::size_t offset, std::size_t length) {
  const std::string_view first = std::string_view(bytes).substr(offset, prefix_bytes);
  if (first.starts_with("\x15\x03")) return "the server speaks TLS, which was not asked for (--tls)";  // an alert
  if (first == "HTTP") return "an HTTP server answers: not the port of the protocol";
  return "a message of " + std::to_string(length) + " bytes: not a pneuma-server";
}

std::string tls_failure(error_code error, const SSL* tls) {
  const bool is_of_tls = error.category() == asio::error::get_ssl_category();
  const int reason = is_of_tls ? ERR_GET_REASON(static_cast<unsigned long>(error.value())) : 0;
  if (reason == SSL_R_WRONG_VERSION_NUMBER) return "TLS: the server does not speak it";
  if (reason != SSL_R_CERTIFICATE_VERIFY_FAILED) return "TLS: " + error.message();
  const long why = SSL_get_verify_result(tls);
  // The check of the host's name gives no reason of its own.
  return std::string("TLS: the server's certificate is not trusted: ") +
         (why == X509_V_ERR_UNSPECIFIED ? "it is for another host name" : X509_verify_cert_error_string(why));
}

base::Status unavailable(std::string what) {
  return {base::StatusCode::unavailable, std::move(what)};
}

}  // namespace

base::Status Connection::open(const std::string& host, const std::string& port, bool tls, const std::string& ca_file,
                              Deadline deadline) {
  asio::ip::tcp::resolver resolver(io_);
  asio::ip::tcp::resolver::results_type endpoints;
  error_code error = await(
      [&](const auto& done) {
        resolver.async_resolve(host, port, [&endpoints, done](error_code failed, const auto& results) {
          if (!failed) endpoints = results;
          done(failed);
        });
      },
      deadline);
  if (error) return unavailable("cannot resolve the name: " + error.message());

  error = await(
      [&](const auto& done) {
        asio::async_connect(socket_, endpoints, [done](error_code failed, const auto&) { done(failed); });
      },
      deadline);
  if (error == boost::asio::error::connection_refused) {
    return unavailable("cannot connect: " + error.message() + "; is a server running there?");
  }
  if (error) return unavailable("cannot connect: " + error.message());
  socket_.set_option(asio::ip::tcp::no_delay(true), error);  // without it, requests leave a little later

  if (tls) {
    base::Status started = start_tls(host, ca_file, deadline);
    if (!started.ok()) return started;
  }
  read_some();
  return {};
}

base::Status Connection::start_tls(const std::string& host, const std::string& ca_file, Deadline deadline) {
  error_code error;
  tls_context_.emplace(asio::ssl::context::tls_client);
  if (ca_file.empty()) {
    tls_context_->set_default_verify_paths(error);
  } else {
    tls_context_->load_verify_file(ca_file, error);
  }
  if (error) return base::invalid("cannot read the certificates: " + error.message(), ca_file);
  tls_.emplace(socket_, *tls_context_);
  tls_->set_verify_mode(asio::ssl::verify_peer, error);
  tls_->set_verify_callback(asio::ssl::host_name_verification(host), error);
  SSL_set_tlsext_host_name(tls_->native_handle(), host.c_str());
  error = await(
      [&](const auto& done) {
        tls_->async_handshake(asio::ssl::stream_base::client, [done](error_code failed) { done(failed); });
      },
      deadline);
  if (error) return unavailable(tls_failure(error, tls_->native_handle()));
  return {};
}

error_code Connection::await(const std::function<void(std::function<void(error_code)>)>& start, Deadline deadline) {
  // Shared: an operation given up on still holds its handler.
  const auto result = std::make_shared<std::optional<error_code>>();
  start([result](error_code error) { *result = error; });
  if (!run_until(deadline, [&] { return result->has_value(); })) return asio::error::timed_out;
  return **result;
}

bool Connection::run_until(Deadline deadline, const std::function<bool()>& done) {
  // Past the deadline what is ready still counts, up to some megabytes: a server that never stops sending must not hold
  // us.
  constexpr int late_operations_max = 64;
  for (int late = 0; late < late_operations_max;) {
    if (done()) return true;  // first: nothing more is read while there are messages to take
    if (!failure_.ok()) return false;
    const bool is_late = std::chrono::steady_clock::now() >= deadline;
    io_.restart();
    const std::size_t operations = is_late ? io_.poll_one() : io_.run_one_until(deadline);
    if (is_late && operations == 0) return false;
    if (is_late) ++late;
  }
  return false;
}

void Connection::queue(const std::string& message) {
  output_.push_back(with_length(message));
  if (output_.size() == 1) write_next();
}

void Connection::write_next() {
  const auto written = [this](error_code error, std::size_t) {
    if (error) return fail("sending", error);
    output_.pop_front();
    if (!output_.empty()) write_next();
  };
  const auto bytes = asio::buffer(output_.front());
  if (tls_) {
    asio::async_write(*tls_, bytes, written);
  } else {
    asio::async_write(socket_, bytes, written);
  }
}

base::Status Connection::flush(Deadline deadline) {
  if (run_until(deadline, [this] { return output_.empty(); })) return {};
  if (failure_.ok()) failure_ = unavailable("the server takes no more bytes");
  return failure_;
}

void Connection::read_some() {
  const auto got = [this](error_code error, std::size_t count) {
    if (error) return fail("receiving", error);
    has_received_ = true;
    input_.append(chunk_.data(), count);
    read_some();
  };
  if (tls_) {
    tls_->async_read_some(asio::buffer(chunk_), got);
  } else {
    socket_.async_read_some(asio::buffer(chunk_), got);
  }
}

void Connection::fail(const std::string& action, error_code error) {
  if (!failure_.ok()) return;
  const bool ended = error == asio::error::eof || error == asio::ssl::error::stream_truncated;
  if (!ended) {
    failure_ = unavailable(action + ": " + error.message());
  } else if (has_received_ || tls_) {
    failure_ = unavailable("the server closed the connection");
  } else {  // as one does that waits for a TLS handshake
    failure_ = unavailable("the server closed the connection without a word; does it speak TLS (--tls)?");
  }
}

base::Result<std::optional<std::string>> Connection::receive(Deadline deadline) {
  std::optional<std::string> message;
  const bool got = run_until(deadline, [&] {
    if (!message) message = take_message();
    return message.has_value();
  });
  if (!got && !failure_.ok()) return failure_;
  return message;
}

std::optional<std::string> Connection::take_message() {
  const std::size_t held = input_.size() - input_taken_;
  if (held < prefix_bytes) return std::nullopt;
  const std::size_t length = length_at(input_, input_taken_);
  if (length == 0 || length > received_message_bytes_max) {
    if (failure_.ok()) {
      failure_ = {base::StatusCode::malformed, no_message(input_, input_taken_, length)};
    }
    return std::nullopt;
  }
  if (held - prefix_bytes < length) return std::nullopt;
  std::string message = input_.substr(input_taken_ + prefix_bytes, length);
  input_taken_ += prefix_bytes + length;
  if (input_taken_ * 2 > input_.size()) {
    input_.erase(0, input_taken_);
    input_taken_ = 0;
  }
  return message;
}

}  // namespace pneuma::client
