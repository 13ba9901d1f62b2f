// A WebSocket of Beast's own to a server's /ws: one message a WebSocket message.
#pragma once

#include <cstdint>
#include <string>

#include <boost/asio.hpp>
#include <boost/beast.hpp>
#include <gtest/gtest.h>

#include "pneuma/v1/session.pb.h"

namespace pneuma::integration {

/// Of HOST:PORT.
inline boost::asio::ip::tcp::endpoint endpoint_of(const std::string& address) {
  const auto colon = address.rfind(':');
  return {boost::asio::ip::make_address(address.substr(0, colon)),
          static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1)))};
}

class WebSocket {
 public:
  WebSocket(boost::asio::io_context& io, const boost::asio::ip::tcp::endpoint& endpoint) : stream_(io) {
    stream_.next_layer().connect(endpoint);
    stream_.handshake("localhost", "/ws");
    stream_.binary(true);
  }
  void send(const v1::ClientMessage& message) { stream_.write(boost::asio::buffer(message.SerializeAsString())); }
  v1::ServerMessage receive() {
    boost::beast::flat_buffer buffer;
    stream_.read(buffer);
    v1::ServerMessage message;
    EXPECT_TRUE(message.ParseFromArray(buffer.data().data(), static_cast<int>(buffer.size())));
    return message;
  }
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket>& stream() { return stream_; }

 private:
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> stream_;
};

}  // namespace pneuma::integration
