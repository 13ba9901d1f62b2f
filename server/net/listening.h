// What it takes to listen: addresses from text, certificates from files, sockets set up.
#pragma once

#include <memory>
#include <string>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>

#include "base/status.h"
#include "net/server.h"

namespace pneuma::net {

namespace asio = boost::asio;

/// HOST:PORT or [V6]:PORT.
[[nodiscard]] std::string to_text(const asio::ip::tcp::endpoint& endpoint);

/// Opens, binds and listens. Errors name the address and the cause.
[[nodiscard]] base::Result<asio::ip::tcp::acceptor> listen_at(asio::io_context& io, const std::string& address);

/// Errors name the file and the cause.
[[nodiscard]] base::Result<std::shared_ptr<asio::ssl::context>> load_tls(const Tls& tls);

/// The name under which an address's connections are counted.
[[nodiscard]] std::string counted_as(const asio::ip::address& address);

/// For messages that are short and pressing.
void tune(asio::ip::tcp::socket& socket);

}  // namespace pneuma::net
