#include "net/http_front.h"

#include <array>
#include <chrono>
#include <optional>
#include <utility>

#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include "base/limits.h"
#include "net/error_into.h"
#include "net/http_stream.h"
#include "net/origin.h"

namespace pneuma::net {

namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;
using WebSocket = websocket::stream<HttpStream, false>;  // it is never offered to compress messages
using Request = http::request<http::empty_body>;
using Body = http::span_body<const char>;  // the bytes are the reply's
using Response = http::response<Body>;

// A request line and headers are small; more is not for us.
constexpr std::uint32_t header_bytes_max = 8 * 1024;
// For the client to take the last reply and close; a close with bytes unread would reset the connection under it.
constexpr std::chrono::seconds http_linger_timeout{1};
// A WebSocket message goes out in parts of this size, so that a slow reader's progress shows.
constexpr std::size_t websocket_part_bytes = 16 * 1024;

// The page loads what lies beside it and nothing else.
constexpr const char* content_security_policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "worker-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

class WebSocketTransport final : public Transport {
 public:
  WebSocketTransport(WebSocket socket, const base::MemoryBudget& memory)
      : socket_(std::move(socket)), incoming_(memory) {
    socket_.read_message_max(message_bytes_max_);  // past it Beast closes as soon as the length is announced
    socket_.binary(true);
    socket_.auto_fragment(false);
    socket_.next_layer().expires_never();  // the session keeps the time from here on
  }

  asio::awaitable<base::Status> open() override { co_return base::Status(); }

  asio::awaitable<base::Result<std::optional<ReceivedMessage>>> read(std::function<void(bool)> progressed) override {
    beast::flat_buffer buffer;
    do {
      error_code error;
      co_await socket_.async_read_some(buffer, message_bytes_max_ - buffer.size(), into(error));
      if (error == websocket::error::closed) co_return std::optional<ReceivedMessage>();
      if (error.category() == make_error_code(websocket::error::closed).category()) {
        co_return base::Status(base::StatusCode::malformed, error.message());
      }
      if (error) co_return base::Status(base::StatusCode::unavailable, error.message());
      progressed(!socket_.is_message_done());
      if (base::Status no_room = incoming_.hold(buffer.capacity()); !no_room.ok()) co_return no_room;
    } while (!socket_.is_message_done());
    if (!socket_.got_binary())
      co_return base::Status(base::StatusCode::malformed, "a text message; messages are binary");
    if (buffer.size() == 0) co_return base::Status(base::StatusCode::malformed, "an empty message");
    co_return std::optional<ReceivedMessage>(incoming_.whole(beast::buffers_to_string(buffer.data())));
  }

  asio::awaitable<error_code> write(std::vector<SharedBytes> messages,
                                    std::function<void(std::size_t)> progressed) override {
    error_code error;
    for (const SharedBytes& message : messages) {
      for (std::size_t at = 0; at < message->size() && !error; at += websocket_part_bytes) {
        const std::size_t size = std::min(websocket_part_bytes, message->size() - at);
        co_await socket_.async_write_some(at + size == message->size(), asio::buffer(message->data() + at, size),
                                          into(error));
        progressed(size);
      }
    }
    co_return error;
  }

  void set_limit(std::size_t message_bytes_max) override {
    message_bytes_max_ = message_bytes_max;
    socket_.read_message_max(message_bytes_max_);
  }

  asio::awaitable<void> shut_down() override {
    error_code ignored;
    co_await socket_.async_close(websocket::close_code::normal, into(ignored));
  }

  void abort() override {
    error_code ignored;
    socket_.next_layer().socket().close(ignored);
  }

 private:
  WebSocket socket_;
  IncomingBytes incoming_;
  std::size_t message_bytes_max_ = base::message_bytes_max_before_hello;
};

bool may_upgrade(const Request& request) {
  const auto origin = request.find(http::field::origin);  // programs send none
  return origin == request.end() || is_same_origin(origin->value(), request[http::field::host]);
}

/// A weight of 0 says no, and `*` stands for the codings that are not named (RFC 9110, 12.5.3).
bool takes_gzip(const Request& request) {
  std::optional<bool> gzip;
  std::optional<bool> any;
  const http::ext_list codings(request[http::field::accept_encoding]);
  for (const auto& [coding, parameters] : codings) {
    bool taken = true;
    for (const auto& [name, value] : parameters) {
      if (beast::iequals(name, "q")) taken = value.find_first_not_of("0.") != std::string_view::npos;
    }
    if (beast::iequals(coding, "gzip")) gzip = taken;
    if (coding == "*") any = taken;
  }
  return gzip.value_or(any.value_or(false));
}

/// What goes out for a request is one of a file's two forms; they differ, so their tags do.
bool goes_compressed(const Request& request, const HttpReply& reply) {
  return reply.gzip_body != nullptr && takes_gzip(request);
}

std::string compressed_tag(const std::string& tag) {
  return tag.substr(0, tag.size() - 1).append("-gzip\"");
}

/// Whether the client holds this content already.
bool is_held(const Request& request, const std::string& tag) {
  const std::string_view held = request[http::field::if_none_match];
  return !tag.empty() && (held == "*" || held.find(tag) != std::string_view::npos);
}

/// Of bytes that the reply holds.
Response make_response(const Request& request, const HttpReply& reply) {
  Response response{static_cast<http::status>(reply.status), request.version()};
  response.set(http::field::content_type, reply.content_type);
  response.set(http::field::cache_control, reply.tag.empty() ? "no-store" : "no-cache");  // kept, but asked about
  if (!reply.tag.empty()) {
    response.set(http::field::etag, reply.tag);
    response.set(http::field::vary, "Accept-Encoding");
  }
  response.set("Content-Security-Policy", content_security_policy);
  response.set("Referrer-Policy", "no-referrer");
  response.set("X-Content-Type-Options", "nosniff");
  if (reply.status == 401) response.set(http::field::www_authenticate, "Bearer");
  if (reply.status == 405) response.set(http::field::allow, "GET, HEAD");
  if (reply.status == 426) response.set(http::field::upgrade, "websocket");
  if (reply.status == 503) response.set(http::field::retry_after, "1");
  response.keep_alive(request.keep_alive());
  const std::string* bytes = reply.body.get();
  if (goes_compressed(request, reply)) {
    response.set(http::field::content_encoding, "gzip");
    bytes = reply.gzip_body.get();
  }
  if (bytes != nullptr) response.body() = Body::value_type(bytes->data(), bytes->size());
  if (reply.status != 304) response.prepare_payload();  // a length would be that of what is not sent
  return response;
}

/// Why a request that is whole is not answered; none: it is.
std::optional<HttpReply> objection(const Request& request, const HttpFront& front) {
  // Whoever passes requests on may take another of two for the one that counts.
  if (request.count(http::field::host) != 1) return text_reply(400, "one Host is wanted\n");
  if (request.count(http::field::origin) > 1) return text_reply(400, "one Origin is taken\n");
  if (!front.hosts.allow(request[http::field::host])) {
    return text_reply(421, "this server does not go by that name; pneuma-server --allow-host tells it its names\n");
  }
  if (request.count(http::field::transfer_encoding) > 0) return text_reply(400, "no transfer coding is taken\n");
  return std::nullopt;
}

HttpReply answer(const Request& request, const HttpFront& front) {
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    return text_reply(405, "only GET and HEAD are answered here\n");
  }
  const std::string_view target = request.target();
  if (!target.starts_with('/')) return text_reply(400, "the target must be a path\n");
  const std::string_view path = target.substr(0, target.find('?'));
  if (path == "/ws" && front.upgraded) return text_reply(426, "speaks WebSocket only\n");
  HttpReply reply = front.reply({path, request[http::field::authorization], front.counted_as});
  if (!reply.tag.empty() && goes_compressed(request, reply)) reply.tag = compressed_tag(reply.tag);
  if (is_held(request, reply.tag)) return {304, std::move(reply.content_type), {}, {}, std::move(reply.tag)};
  return reply;
}

// Why a request's bytes were not taken; none: the connection is over.
std::optional<HttpReply> refusal(const error_code& error) {
  if (error == http::error::unexpected_body || error == http::error::body_limit)
    return text_reply(413, "a body is not taken\n");
  if (error == http::error::header_limit || error == http::error::buffer_overflow)
    return text_reply(431, "the header is too large\n");
  if (error.category() == make_error_code(http::error::bad_method).category() && error != http::error::end_of_stream &&
      error != http::error::partial_message) {
    return text_reply(400, "not an HTTP request\n");
  }
  return std::nullopt;
}

asio::awaitable<void> upgrade(HttpStream stream, Request request, const HttpFront& front) {
  WebSocket socket(std::move(stream));
  error_code error;
  co_await socket.async_accept(request, into(error));
  if (!error) front.upgraded(std::make_unique<WebSocketTransport>(std::move(socket), front.memory));
}

asio::awaitable<error_code> write_response(HttpStream& stream, Response response, bool header_only) {
  http::response_serializer<Body> serializer(response);
  error_code error;
  if (header_only) {
    co_await http::async_write_header(stream, serializer, into(error));
  } else {
    co_await http::async_write(stream, serializer, into(error));
  }
  co_return error;
}

// Reads and throws away what still comes, until the client closes.
asio::awaitable<void> linger(HttpStream& stream) {
  error_code error;
  stream.expires_after(http_linger_timeout);
  stream.socket().shutdown(asio::ip::tcp::socket::shutdown_send, error);
  std::array<char, 4 * 1024> unread;
  while (!error) co_await stream.socket().async_read_some(asio::buffer(unread), into(error));
}

asio::awaitable<void> serve(HttpStream stream, const HttpFront& front) {
  stream.expires_after(front.timeout);
  if (co_await stream.shake_hands()) co_return;
  beast::flat_buffer buffer(header_bytes_max);
  bool keep_alive = true;
  while (keep_alive) {
    stream.expires_after(front.timeout);
    http::request_parser<http::empty_body> parser;
    parser.header_limit(header_bytes_max);
    error_code error;
    co_await http::async_read(stream, buffer, parser, into(error));
    std::optional<HttpReply> reply = refusal(error);
    if (error && !reply) co_return;
    const bool is_whole = !error;
    const Request request = parser.release();
    if (is_whole) reply = objection(request, front);
    if (!reply && front.upgraded && websocket::is_upgrade(request) && request.target() == "/ws") {
      if (!may_upgrade(request)) {
        reply = text_reply(403, "a page of another origin may not connect\n");
      } else if (buffer.size() > 0) {
        reply = text_reply(400, "nothing may follow an upgrade before it is answered\n");
      } else {
        co_return co_await upgrade(std::move(stream), request, front);
      }
    }
    if (!reply) reply = answer(request, front);
    keep_alive = is_whole && reply->status != 400 && front.upgraded && request.keep_alive();
    Response response = make_response(request, *reply);
    response.keep_alive(keep_alive);
    stream.expires_after(front.timeout);
    if (co_await write_response(stream, std::move(response), request.method() == http::verb::head)) co_return;
  }
  co_await linger(stream);
}

}  // namespace

asio::awaitable<void> serve_http(asio::ip::tcp::socket socket, asio::ssl::context* tls, const HttpFront& front) {
  co_await serve(HttpStream(std::move(socket), tls), front);
}

}  // namespace pneuma::net
