// Length-prefixed messages over a stream of bytes.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "net/error_into.h"
#include "net/framing.h"
#include "net/transport.h"

namespace pneuma::net {

/// What a transport asks of a TCP socket, of TLS over one, or of a simulated one. A specialisation has:
///   static constexpr bool joins_parts: each write becomes one part of its own
///   static auto& socket(Stream&): what is under TLS, or the stream itself
///   static asio::awaitable<base::Status> begin(Stream&), static asio::awaitable<void> end(Stream&)
template <class Stream>
struct StreamTraits;

template <class Stream>
class StreamTransport final : public Transport {
 public:
  template <class... Arguments>
  StreamTransport(std::size_t message_bytes_max, const base::MemoryBudget& memory, Arguments&&... arguments)
      : stream_(std::forward<Arguments>(arguments)...), reader_(message_bytes_max), incoming_(memory) {}

  asio::awaitable<base::Status> open() override {
    const base::Status opened = co_await Traits::begin(stream_);
    peer_is_plain_ = opened.code() == base::StatusCode::unsupported;
    co_return opened;
  }

  asio::awaitable<base::Result<std::optional<ReceivedMessage>>> read(std::function<void(bool)> progressed) override {
    boost::system::error_code error;
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

  asio::awaitable<boost::system::error_code> write(std::vector<SharedBytes> messages,
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
    if constexpr (Traits::joins_parts) {
      for (const asio::const_buffer& part : parts) joined.append(static_cast<const char*>(part.data()), part.size());
      parts = {asio::buffer(joined)};
    }
    std::size_t first = 0;
    while (first < parts.size()) {
      boost::system::error_code error;
      const std::vector<asio::const_buffer> rest(parts.begin() + static_cast<std::ptrdiff_t>(first), parts.end());
      std::size_t taken = 0;
      if (peer_is_plain_) {
        taken = co_await Traits::socket(stream_).async_write_some(rest, into(error));
      } else {
        taken = co_await stream_.async_write_some(rest, into(error));
      }
      if (error) co_return error;
      progressed(taken);
      while (first < parts.size() && taken >= parts[first].size()) taken -= parts[first++].size();
      if (first < parts.size()) parts[first] += taken;
    }
    co_return boost::system::error_code();
  }

  void set_limit(std::size_t message_bytes_max) override { reader_.set_limit(message_bytes_max); }

  asio::awaitable<void> shut_down() override {
    boost::system::error_code error;
    Traits::socket(stream_).cancel(error);  // a read under way would be in the way of what follows
    co_await asio::post(stream_.get_executor(), asio::use_awaitable);
    if (!peer_is_plain_) co_await Traits::end(stream_);
    // What the client still sends is read and thrown away until it closes; a close with bytes unread would reset the
    // connection and lose the goodbye on its way.
    Traits::socket(stream_).shutdown(asio::ip::tcp::socket::shutdown_send, error);
    while (!error) co_await Traits::socket(stream_).async_read_some(asio::buffer(buffer_), into(error));
  }

  void abort() override {
    boost::system::error_code ignored;
    Traits::socket(stream_).close(ignored);
  }

 private:
  using Traits = StreamTraits<Stream>;
  static constexpr std::size_t read_bytes = 16 * 1024;

  // Many TLS clients close without saying so in TLS; the length prefix tells whether a message is cut.
  static bool is_end(const boost::system::error_code& error) {
    return error == asio::error::eof || error == asio::ssl::error::stream_truncated;
  }

  Stream stream_;
  bool peer_is_plain_ = false;  // where TLS was wanted
  FrameReader reader_;
  IncomingBytes incoming_;
  std::array<char, read_bytes> buffer_{};
  std::string_view unread_;
};

}  // namespace pneuma::net
