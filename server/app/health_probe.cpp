#include "app/health_probe.h"

#include <chrono>
#include <exception>

#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>

#include "base/address.h"

namespace pneuma::app {

namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

constexpr std::chrono::seconds patience{5};

// Read to the end: the server closes after its answer, and a TLS peer may do so without a word.
template <class Stream>
asio::awaitable<std::string> get(Stream& stream, const std::string& host) {
  const std::string request = "GET /healthz HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n";
  co_await asio::async_write(stream, asio::buffer(request), asio::use_awaitable);
  std::string reply;
  boost::system::error_code error;
  co_await asio::async_read(stream, asio::dynamic_buffer(reply, 64 * 1024),
                            asio::redirect_error(asio::use_awaitable, error));
  co_return reply;
}

asio::awaitable<std::string> connect_and_get(std::string host, std::string port, bool tls) {
  const auto executor = co_await asio::this_coro::executor;
  tcp::resolver resolver(executor);
  const auto endpoints = co_await resolver.async_resolve(host, port, asio::use_awaitable);
  tcp::socket socket(executor);
  co_await asio::async_connect(socket, endpoints, asio::use_awaitable);
  if (!tls) co_return co_await get(socket, host);
  asio::ssl::context context(asio::ssl::context::tls_client);
  asio::ssl::stream<tcp::socket&> secure(socket, context);
  co_await secure.async_handshake(asio::ssl::stream_base::client, asio::use_awaitable);
  co_return co_await get(secure, host);
}

base::Status unavailable(std::string what, const std::string& address) {
  return {base::StatusCode::unavailable, std::move(what), address};
}

}  // namespace

base::Status probe_health(const std::string& address, bool tls) {
  auto parsed = base::parse_address(address);
  if (!parsed.ok()) return parsed.status();
  std::string& host = parsed->host;
  // A server that listens on every address answers on this one.
  if (host == "0.0.0.0") host = "127.0.0.1";
  if (host == "::") host = "::1";

  asio::io_context io;
  std::string reply;
  std::exception_ptr failure;
  asio::co_spawn(io, connect_and_get(host, parsed->port, tls), [&](std::exception_ptr error, std::string text) {
    failure = std::move(error);
    reply = std::move(text);
  });
  io.run_for(patience);
  try {
    if (failure) std::rethrow_exception(failure);
  } catch (const std::exception& error) {
    return unavailable(error.what(), address);
  }
  const auto body = reply.find("\r\n\r\n");
  if (body == std::string::npos) return unavailable("no answer", address);
  if (reply.starts_with("HTTP/1.1 200")) return {};
  std::string text = reply.substr(body + 4);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return unavailable(text, address);
}

}  // namespace pneuma::app
