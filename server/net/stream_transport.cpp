// Length-prefixed messages over TCP and TLS.
#include "net/stream_transport.h"

#include <memory>
#include <utility>

#include <boost/asio/ssl/stream.hpp>

namespace pneuma::net {

namespace {

using boost::system::error_code;
using Tcp = asio::ip::tcp;
using TlsStream = asio::ssl::stream<Tcp::socket>;

// TLS, RFC 8446 5.1: the type of the record that a client begins with. No envelope within the limit before hello does.
constexpr char tls_handshake_record = 22;

base::Status broken(const error_code& error) {
  return {base::StatusCode::unavailable, error.message()};
}

}  // namespace

template <>
struct StreamTraits<Tcp::socket> {
  static constexpr bool joins_parts = false;
  static Tcp::socket& socket(Tcp::socket& stream) { return stream; }
  static asio::awaitable<base::Status> begin(Tcp::socket& /*stream*/) { co_return base::Status(); }
  static asio::awaitable<void> end(Tcp::socket& /*stream*/) { co_return; }
};

template <>
struct StreamTraits<TlsStream> {
  static constexpr bool joins_parts = true;  // each would be a record
  static Tcp::socket& socket(TlsStream& stream) { return stream.next_layer(); }
  // The handshake.
  static asio::awaitable<base::Status> begin(TlsStream& stream) {
    error_code error;
    co_await socket(stream).async_wait(Tcp::socket::wait_read, into(error));
    char first = tls_handshake_record;
    if (!error) socket(stream).receive(asio::buffer(&first, 1), Tcp::socket::message_peek, error);
    if (error) co_return broken(error);
    if (first != tls_handshake_record) {
      co_return base::Status(base::StatusCode::unsupported, "this port speaks TLS, and the client does not");
    }
    co_await stream.async_handshake(asio::ssl::stream_base::server, into(error));
    if (error) co_return broken(error);
    co_return base::Status();
  }
  static asio::awaitable<void> end(TlsStream& stream) {
    error_code error;
    co_await stream.async_shutdown(into(error));
  }
};

std::unique_ptr<Transport> make_stream_transport(Tcp::socket socket, asio::ssl::context* tls,
                                                 std::size_t message_bytes_max, const base::MemoryBudget& memory) {
  if (tls == nullptr) {
    return std::make_unique<StreamTransport<Tcp::socket>>(message_bytes_max, memory, std::move(socket));
  }
  return std::make_unique<StreamTransport<TlsStream>>(message_bytes_max, memory, std::move(socket), *tls);
}

}  // namespace pneuma::net
