// No bytes from a browser, or from what is none, may crash or hold the HTTP address: each connection is answered in
// HTTP, or becomes a WebSocket, and ends.
// Input: what the client sends before it ends its side.
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/write.hpp>

#include "net/error_into.h"
#include "net/http_front.h"
#include "net/origin.h"

using namespace pneuma;
using Tcp = net::asio::ip::tcp;

namespace {

void must(bool holds) {
  if (!holds) std::abort();
}

net::asio::awaitable<void> read_all(std::unique_ptr<net::Transport> transport) {
  if ((co_await transport->open()).ok()) {
    while (true) {
      const auto message = co_await transport->read([](bool) {});
      if (!message.ok() || !*message) break;
    }
  }
  transport->abort();
}

net::asio::awaitable<void> browse(Tcp::socket socket, std::string_view input, std::string& answer) {
  boost::system::error_code error;
  co_await net::asio::async_write(socket, net::asio::buffer(input), net::into(error));
  socket.shutdown(Tcp::socket::shutdown_send, error);
  std::array<char, 4096> some{};
  for (error.clear(); !error;) {
    answer.append(some.data(), co_await socket.async_read_some(net::asio::buffer(some), net::into(error)));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  net::asio::io_context io{1};
  Tcp::acceptor acceptor(io, Tcp::endpoint(net::asio::ip::address_v4::loopback(), 0));
  Tcp::socket client(io);
  boost::system::error_code error;
  client.connect(acceptor.local_endpoint(), error);
  if (error == boost::system::errc::interrupted) return 0;  // by the fuzzer's own clock
  must(!error);
  Tcp::socket server = acceptor.accept();

  bool is_over = false;
  std::string answer;
  const net::AllowedHosts hosts;
  const net::HttpFront front{
      .reply = [](const net::PageRequest& request) { return net::text_reply(200, std::string(request.path)); },
      .upgraded =
          [&io](std::unique_ptr<net::Transport> transport) {
            net::asio::co_spawn(io, read_all(std::move(transport)), net::asio::detached);
          },
      .timeout = std::chrono::seconds(4),
      .memory = base::MemoryBudget(16 * 1024 * 1024),
      .hosts = hosts,
      .counted_as = "fuzz"};
  net::asio::co_spawn(io, net::serve_http(std::move(server), nullptr, front),
                      [&is_over](const std::exception_ptr& failure) {
                        must(!failure);
                        is_over = true;
                      });
  net::asio::co_spawn(io, browse(std::move(client), {reinterpret_cast<const char*>(bytes), size}, answer),
                      net::asio::detached);
  io.run();
  must(is_over);
  must(answer.empty() || answer.starts_with("HTTP/1."));
  return 0;
}
