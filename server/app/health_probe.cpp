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
using boost::system::error_code;

constexpr std::chrono::seconds patience{5};

base::Status unavailable(std::string what) {
  return {base::StatusCode::unavailable, std::move(what)};
}

auto into(error_code& error) {
  return asio::redirect_error(asio::use_awaitable, error);
}

/// What an answer says of the server's health.
base::Status judge(const std::string& reply) {
  const auto body = reply.find("\r\n\r\n");
  if (body == std::string::npos) return unavailable("no HTTP answer; does one side alone speak TLS?");
  if (reply.starts_with("HTTP/1.1 200")) return {};
  std::string text = reply.substr(body + 4);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return unavailable(text);
}

// Read to the end: the server closes after its answer, and a TLS peer may do so without a word.
template <class Stream>
asio::awaitable<base::Status> ask(Stream& stream, const std::string& host) {
  const std::string name = host.find(':') == std::string::npos ? host : '[' + host + ']';  // an IPv6 address
  const std::string request = "GET /healthz HTTP/1.1\r\nHost: " + name + "\r\nConnection: close\r\n\r\n";
  error_code error;
  co_await asio::async_write(stream, asio::buffer(request), into(error));
  if (error) co_return unavailable("cannot ask: " + error.message());
  std::string reply;
  co_await asio::async_read(stream, asio::dynamic_buffer(reply, 64 * 1024), into(error));
  co_return judge(reply);
}

asio::awaitable<base::Status> connect_and_ask(std::string host, std::string port, bool tls) {
  const auto executor = co_await asio::this_coro::executor;
  error_code error;
  tcp::resolver resolver(executor);
  const auto endpoints = co_await resolver.async_resolve(host, port, into(error));
  if (error) co_return unavailable("cannot resolve the name: " + error.message());
  tcp::socket socket(executor);
  co_await asio::async_connect(socket, endpoints, into(error));
  if (error) co_return unavailable("cannot connect: " + error.message());
  if (!tls) co_return co_await ask(socket, host);
  asio::ssl::context context(asio::ssl::context::tls_client);
  asio::ssl::stream<tcp::socket&> secure(socket, context);
  co_await secure.async_handshake(asio::ssl::stream_base::client, into(error));
  if (error) co_return unavailable("TLS: " + error.message());
  co_return co_await ask(secure, host);
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
  base::Status health = unavailable("no answer in time");
  asio::co_spawn(io, connect_and_ask(host, parsed->port, tls),
                 [&health](const std::exception_ptr& thrown, base::Status answer) {
                   health = thrown ? unavailable("cannot ask") : std::move(answer);
                 });
  io.run_for(patience);
  return health.ok() ? health : health.inside(address);
}

}  // namespace pneuma::app
