// The bytes under HTTP and WebSocket, over TLS or plain TCP: one type for both. Beast's operations nest their handlers'
// types, layer in layer; where such a handler is type-erased here, the layers below compile once and not for each.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <memory>
#include <type_traits>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/system/error_code.hpp>

namespace pneuma::net {

namespace asio = boost::asio;

/// A handler of any type, called once, on the executor that it names. It names no cancellation slot: closing the socket
/// ends what is under way.
template <class... Results>
class Completion {
 public:
  using executor_type = asio::any_io_executor;

  template <class Handler>
  Completion(Handler handler, const executor_type& otherwise)
      : executor_(asio::get_associated_executor(handler, otherwise)),
        held_(std::make_unique<HeldHandler<Handler>>(std::move(handler))) {}

  [[nodiscard]] executor_type get_executor() const noexcept { return executor_; }
  void operator()(Results... results) { std::exchange(held_, nullptr)->call(results...); }

 private:
  struct Held {
    virtual ~Held() = default;
    virtual void call(Results... results) = 0;
  };
  template <class Handler>
  struct HeldHandler final : Held {
    explicit HeldHandler(Handler given) : handler(std::move(given)) {}
    void call(Results... results) override { handler(results...); }
    Handler handler;
  };

  executor_type executor_;
  std::unique_ptr<Held> held_;
};

using Transferred = Completion<boost::system::error_code, std::size_t>;
using TornDown = Completion<boost::system::error_code>;

/// What goes out in one call. A WebSocket frame is two buffers, an HTTP header some more; what is left goes with the
/// next.
using OutBuffers = std::array<asio::const_buffer, 8>;

class HttpStream {
 public:
  using executor_type = asio::any_io_executor;

  /// With TLS where `tls` is given.
  HttpStream(asio::ip::tcp::socket socket, asio::ssl::context* tls);

  [[nodiscard]] executor_type get_executor() const { return layers_->socket().get_executor(); }
  [[nodiscard]] asio::ip::tcp::socket& socket() const { return layers_->socket(); }
  /// The handshake of TLS; plain TCP has none.
  [[nodiscard]] asio::awaitable<boost::system::error_code> shake_hands() { return layers_->shake_hands(); }
  /// Of what begins from here on; the socket is closed where it takes longer.
  void expires_after(std::chrono::milliseconds time) { layers_->expires_after(time); }
  void expires_never() { layers_->expires_never(); }

  // What Beast asks of a stream, by Beast's names.
  template <class Token>
  using Initiated =
      typename asio::async_result<std::decay_t<Token>, void(boost::system::error_code, std::size_t)>::return_type;

  template <class Buffers, class Token>
  Initiated<Token> async_read_some(const Buffers& buffers, Token&& token) {
    return asio::async_initiate<Token, void(boost::system::error_code, std::size_t)>(
        [this, to = first_of(buffers)](auto handler) {
          layers_->read_some(to, Transferred(std::move(handler), get_executor()));
        },
        token);
  }

  template <class Buffers, class Token>
  Initiated<Token> async_write_some(const Buffers& buffers, Token&& token) {
    return asio::async_initiate<Token, void(boost::system::error_code, std::size_t)>(
        [this, from = first_ones_of(buffers)](auto handler) {
          layers_->write_some(from, Transferred(std::move(handler), get_executor()));
        },
        token);
  }

  template <class Handler>
  friend void async_teardown(boost::beast::role_type role, HttpStream& stream, Handler&& handler) {
    stream.layers_->tear_down(role, TornDown(std::forward<Handler>(handler), stream.get_executor()));
  }

  friend void beast_close_socket(HttpStream& stream) {
    boost::system::error_code ignored;
    stream.socket().close(ignored);
  }

 private:
  struct Layers {
    virtual ~Layers() = default;
    virtual asio::ip::tcp::socket& socket() = 0;
    virtual asio::awaitable<boost::system::error_code> shake_hands() = 0;
    virtual void expires_after(std::chrono::milliseconds time) = 0;
    virtual void expires_never() = 0;
    virtual void read_some(asio::mutable_buffer to, Transferred transferred) = 0;
    virtual void write_some(const OutBuffers& from, Transferred transferred) = 0;
    virtual void tear_down(boost::beast::role_type role, TornDown torn_down) = 0;
  };
  template <class Stream>
  struct LayersOf;

  template <class Buffers>
  static asio::mutable_buffer first_of(const Buffers& buffers) {
    auto at = asio::buffer_sequence_begin(buffers);
    const auto end = asio::buffer_sequence_end(buffers);
    while (at != end && asio::mutable_buffer(*at).size() == 0) ++at;
    return at == end ? asio::mutable_buffer() : asio::mutable_buffer(*at);
  }

  template <class Buffers>
  static OutBuffers first_ones_of(const Buffers& buffers) {
    OutBuffers first;
    std::size_t count = 0;
    const auto end = asio::buffer_sequence_end(buffers);
    for (auto at = asio::buffer_sequence_begin(buffers); at != end && count < first.size(); ++at) {
      const asio::const_buffer buffer(*at);
      if (buffer.size() > 0) first[count++] = buffer;
    }
    return first;
  }

  std::unique_ptr<Layers> layers_;
};

}  // namespace pneuma::net
