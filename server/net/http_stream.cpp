#include "net/http_stream.h"

#include <utility>

#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/teardown.hpp>

#include "net/error_into.h"

namespace pneuma::net {

namespace beast = boost::beast;
using boost::system::error_code;
using Plain = beast::tcp_stream;
using Secure = asio::ssl::stream<beast::tcp_stream>;

namespace {

asio::awaitable<error_code> shake_hands_of(Plain& /*stream*/) {
  co_return error_code();
}
asio::awaitable<error_code> shake_hands_of(Secure& stream) {
  error_code error;
  co_await stream.async_handshake(asio::ssl::stream_base::server, into(error));
  co_return error;
}

}  // namespace

template <class Stream>
struct HttpStream::LayersOf final : HttpStream::Layers {
  template <class... Arguments>
  explicit LayersOf(Arguments&&... arguments) : stream(std::forward<Arguments>(arguments)...) {}

  asio::ip::tcp::socket& socket() override { return beast::get_lowest_layer(stream).socket(); }
  asio::awaitable<error_code> shake_hands() override { return shake_hands_of(stream); }
  void expires_after(std::chrono::milliseconds time) override { beast::get_lowest_layer(stream).expires_after(time); }
  void expires_never() override { beast::get_lowest_layer(stream).expires_never(); }
  void read_some(asio::mutable_buffer to, Transferred transferred) override {
    stream.async_read_some(to, std::move(transferred));
  }
  void write_some(const OutBuffers& from, Transferred transferred) override {
    stream.async_write_some(from, std::move(transferred));
  }
  void tear_down(beast::role_type role, TornDown torn_down) override {
    using beast::websocket::async_teardown;
    async_teardown(role, stream, std::move(torn_down));
  }

  Stream stream;
};

HttpStream::HttpStream(asio::ip::tcp::socket socket, asio::ssl::context* tls) {
  if (tls == nullptr) {
    layers_ = std::make_unique<LayersOf<Plain>>(std::move(socket));
  } else {
    layers_ = std::make_unique<LayersOf<Secure>>(Plain(std::move(socket)), *tls);
  }
}

}  // namespace pneuma::net
