// Length-prefixed messages over TCP and TLS.
#include <array>
#include <string>
#include <type_traits>
#include <utility>

#include <boost/asio/post.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "net/error_into.h"
#include "net/framing.h"
#include "net/transport.h"

namespace pneuma::net {

namespace {

using boost::system::error_code;
using Tcp = asio::ip::tcp;

constexpr std::size_t read_bytes = 16 * 1024;

// TLS, RFC 8446 5.1: the type of the record that a client begins with. No envelope within the limit before hello does.
constexpr char tls_handshake_record = 22;

// Many TLS clients close without saying so in TLS; the length prefix tells whether a message is cut.
bool is_end(const error_code& error) {
  return error == asio::error::eof || error == asio::ssl::error::stream_truncated;
}

Tcp::socket& socket_of(Tcp::socket& stream) {
  return stream;
}
Tcp::socket& socket_of(asio::ssl::stream<Tcp::socket>& stream) {
  return stream.next_layer();
}

base::Status broken(const error_code& error) {
  return {base::StatusCode::unavailable, error.message()};
}

// The handshake of TLS; plain TCP has none.
asio::awaitable<base::Status> shake_hands(Tcp::socket& /*stream*/) {
  co_return base::Status();
}
asio::awaitable<base::Status> shake_hands(asio::ssl::stream<Tcp::socket>& stream) {
  Tcp::socket& socket = stream.next_layer();
  error_code error;
  co_await socket.async_wait(Tcp::socket::wait_read, into(error));
  char first = tls_handshake_record;
  if (!error) socket.receive(asio::buffer(&first, 1), Tcp::socket::message_peek, error);
  if (error) co_return broken(error);
  if (first != tls_handshake_record) {
    co_return base::Status(base::StatusCode::unsupported, "this port speaks TLS, and the client does not");
  }
  co_await stream.async_handshake(asio::ssl::stream_base::server, into(error));
  if (error) co_return broken(error);
  co_return base::Status();
}

asio::awaitable<void> end_stream(Tcp::socket& /*stream*/) {
  co_return;
}
asio::awaitable<void> end_stream(asio::ssl::stream<Tcp::socket>& stream) {
  error_code error;
  co_await stream.async_shutdown(into(error));
}

template <class Stream>
class StreamTransport final : public Transport {
 public:
  template <class... Arguments>
  StreamTransport(std::size_t message_bytes_max, const base::MemoryBudget& memory, Arguments&&... arguments)
      : stream_(std::forward<Arguments>(arguments)...), reader_(message_bytes_max), incoming_(memory) {}

  asio::awaitable<base::Status> open() override {
    const base::Status opened = co_await shake_hands(stream_);
    peer_is_plain_ = opened.code() == base::StatusCode::unsupported;
    co_return opened;
  }

  asio::awaitable<base::Result<std::optional<ReceivedMessage>>> read(std::function<void(bool)> progressed) override {
    error_code error;
    while (true) {
      auto message = reader_.take(unread_);
      if (!message.ok()) co_return message.status();
      if (*message) {
        progressed(false);
        co_return std::optional<ReceivedMessage>(incoming_.whole(std::move(**message)));
      }
      if (base::Status no_room = incoming_.hold(reader_.held_bytes()); !no_room.ok()) co_return no_room;
      progressed(reader_.in_message());
      const std::size_t size = co_await stream_.async_read_some(asio::buffer(buffer_), into(error));
      if (is_end(error) && reader_.in_message()) {
        co_return base::Status(base::StatusCode::malformed, "the connection ended inside a message");
      }
      if (is_end(error)) co_return std::optional<ReceivedMessage>();
      if (error) co_return base::Status(base::StatusCode::unavailable, error.message());
      unread_ = {buffer_.data(), size};
    }
  }

  asio::awaitable<error_code> write(std::vector<SharedBytes> messages,
                                    std::function<void(std::size_t)> progressed) override {
    std::vector<std::array<char, length_prefix_bytes>> prefixes;
    prefixes.reserve(messages.size());
    std::vector<asio::const_buffer> parts;
    for (const SharedBytes& message : messages) {
      prefixes.push_back(length_prefix(message->size()));
      parts.emplace_back(prefixes.back().data(), prefixes.back().size());
      parts.emplace_back(message->data(), message->size());
    }
    std::string joined;
    if constexpr (!std::is_same_v<Stream, Tcp::socket>) {  // TLS would make a record of each part
      for (const asio::const_buffer& part : parts) joined.append(static_cast<const char*>(part.data()), part.size());
      parts = {asio::buffer(joined)};
    }
    std::size_t first = 0;
    while (first < parts.size()) {
      error_code error;
      const std::vector<asio::const_buffer> rest(parts.begin() + static_cast<std::ptrdiff_t>(first), parts.end());
      std::size_t taken = 0;
      if (peer_is_plain_) {
        taken = co_await socket_of(stream_).async_write_some(rest, into(error));
      } else {
        taken = co_await stream_.async_write_some(rest, into(error));
      }
      if (error) co_return error;
      progressed(taken);
      while (first < parts.size() && taken >= parts[first].size()) taken -= parts[first++].size();
      if (first < parts.size()) parts[first] += taken;
    }
    co_return error_code();
  }

  void set_limit(std::size_t message_bytes_max) override { reader_.set_limit(message_bytes_max); }

  asio::awaitable<void> shut_down() override {
    error_code error;
    socket_of(stream_).cancel(error);  // a read under way would be in the way of what follows
    co_await asio::post(stream_.get_executor(), asio::use_awaitable);
    if (!peer_is_plain_) co_await end_stream(stream_);
    // What the client still sends is read and thrown away until it closes; a close with bytes unread would reset the
    // connection and lose the goodbye on its way.
    socket_of(stream_).shutdown(Tcp::socket::shutdown_send, error);
    while (!error) co_await socket_of(stream_).async_read_some(asio::buffer(buffer_), into(error));
  }

  void abort() override {
    error_code ignored;
    socket_of(stream_).close(ignored);
  }

 private:
  Stream stream_;
  bool peer_is_plain_ = false;  // where TLS was wanted
  FrameReader reader_;
  IncomingBytes incoming_;
  std::array<char, read_bytes> buffer_{};
  std::string_view unread_;
};

}  // namespace

std::unique_ptr<Transport> make_stream_transport(Tcp::socket socket, asio::ssl::context* tls,
                                                 std::size_t message_bytes_max, const base::MemoryBudget& memory) {
  if (tls == nullptr) {
    return std::make_unique<StreamTransport<Tcp::socket>>(message_bytes_max, memory, std::move(socket));
  }
  return std::make_unique<StreamTransport<asio::ssl::stream<Tcp::socket>>>(message_bytes_max, memory, std::move(socket),
                                                                           *tls);
}

}  // namespace pneuma::net
