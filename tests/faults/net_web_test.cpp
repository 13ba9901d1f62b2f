// Shows the HTTP address and TLS on real sockets: pages, the WebSocket upgrade and who may ask for it, messages either
// way, and what happens to requests that are wrong, slow or too large. The WebSocket and TLS clients are Beast's and
// OpenSSL's own; the certificate is made anew for each run.
#include <chrono>
#include <cstdio>
#include <fstream>
#include <string>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <gtest/gtest.h>

#include "faults/net_rig.h"
#include "support/self_signed.h"

namespace pneuma::net {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::system::error_code;
using Tcp = asio::ip::tcp;
using namespace std::chrono_literals;

base::Limits impatient_web_limits() {
  base::Limits limits = patient_limits();
  limits.partial_message_timeout = 1s;
  return limits;
}

Tcp::endpoint loopback(std::uint16_t port) {
  return {asio::ip::address_v4::loopback(), port};
}

class Web : public testing::Test {
 public:
  explicit Web(const base::Limits& limits = patient_limits()) : server_(limits) {}

 protected:
  std::string ask(const std::string& request) {
    RawClient client(server_.http_port());
    client.send_bytes(request);
    return client.read_rest();
  }
  // The status of an upgrade asked for with these headers.
  std::string upgrade(const std::string& headers) {
    RawClient client(server_.http_port());
    client.send_bytes("GET /ws HTTP/1.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n" +
                      headers + "\r\n");
    return client.read_bytes(12).value_or("closed").substr(9);
  }

  EchoServer server_;
};

class SlowWeb : public Web {
 public:
  SlowWeb() : Web(impatient_web_limits()) {}
};

// A WebSocket client, connected.
class WebSocket {
 public:
  explicit WebSocket(std::uint16_t port) : socket_(io_) {
    socket_.next_layer().connect(loopback(port));
    socket_.handshake("localhost", "/ws");
    socket_.binary(true);
  }
  error_code write(const std::string& message) {
    error_code error;
    socket_.write(asio::buffer(message), error);
    return error;
  }
  // The message, or "closed".
  std::string read() {
    beast::flat_buffer buffer;
    error_code error;
    socket_.read(buffer, error);
    return error ? "closed" : beast::buffers_to_string(buffer.data());
  }
  websocket::stream<Tcp::socket>& stream() { return socket_; }

 private:
  asio::io_context io_;
  websocket::stream<Tcp::socket> socket_;
};

TEST_F(Web, APage) {
  const std::string reply = ask("GET /hello?to=you HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  EXPECT_TRUE(reply.starts_with("HTTP/1.1 200 "));
  EXPECT_TRUE(reply.ends_with("\r\n\r\nworld"));
  EXPECT_NE(reply.find("X-Content-Type-Options: nosniff\r\n"), std::string::npos);
  EXPECT_NE(reply.find("Cache-Control: no-store\r\n"), std::string::npos);
}

TEST_F(Web, HeadHasTheLengthButNoBody) {
  const std::string reply = ask("HEAD /hello HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  EXPECT_TRUE(reply.starts_with("HTTP/1.1 200 "));
  EXPECT_NE(reply.find("Content-Length: 5\r\n"), std::string::npos);
  EXPECT_TRUE(reply.ends_with("\r\n\r\n"));
}

TEST_F(Web, AFileGoesCompressedWhereThatIsTakenAndNotAgainWhereItIsHeld) {
  const auto get = [&](const std::string& headers) {
    return ask("GET /file HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n" + headers + "\r\n");
  };
  const std::string plain = get("");
  EXPECT_TRUE(plain.ends_with("\r\n\r\nas it is"));
  EXPECT_NE(plain.find("ETag: \"tag\"\r\n"), std::string::npos);
  EXPECT_NE(plain.find("Content-Security-Policy: default-src 'none';"), std::string::npos);
  EXPECT_EQ(plain.find("Content-Encoding"), std::string::npos);

  const std::string compressed = get("Accept-Encoding: deflate, gzip;q=0.8\r\n");
  EXPECT_TRUE(compressed.ends_with("\r\n\r\ncompressed"));
  EXPECT_NE(compressed.find("Content-Encoding: gzip\r\n"), std::string::npos);
  EXPECT_NE(compressed.find("ETag: \"tag-gzip\"\r\n"), std::string::npos) << "strong tags tell the forms apart";

  const std::string held = get("If-None-Match: \"other\", \"tag\"\r\n");
  EXPECT_TRUE(held.starts_with("HTTP/1.1 304 "));
  EXPECT_EQ(held.find("Content-Length"), std::string::npos) << "it would be that of the file";
  EXPECT_TRUE(held.ends_with("\r\n\r\n"));
  EXPECT_TRUE(get("If-None-Match: \"other\"\r\n").starts_with("HTTP/1.1 200 "));

  const std::string gzip = "Accept-Encoding: gzip\r\n";
  const std::string held_compressed = get(gzip + "If-None-Match: \"tag-gzip\"\r\n");
  EXPECT_TRUE(held_compressed.starts_with("HTTP/1.1 304 "));
  EXPECT_NE(held_compressed.find("ETag: \"tag-gzip\"\r\n"), std::string::npos);
  EXPECT_TRUE(get(gzip + "If-None-Match: \"tag\"\r\n").ends_with("\r\n\r\ncompressed"));
  EXPECT_TRUE(get("If-None-Match: \"tag-gzip\"\r\n").ends_with("\r\n\r\nas it is"));
}

TEST_F(Web, OnlyWhoTakesGzipGetsIt) {
  const auto is_compressed = [&](const std::string& codings) {
    return ask("GET /file HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nAccept-Encoding: " + codings + "\r\n\r\n")
        .ends_with("\r\n\r\ncompressed");
  };
  for (const char* yes : {"gzip", "GZIP", "br, gzip", "gzip;q=0.001", "gzip; q=1.0, *;q=0", "*", "*;q=0.5"}) {
    EXPECT_TRUE(is_compressed(yes)) << yes;
  }
  for (const char* no : {"", "br", "gzip;q=0", "gzip; Q=0.000", "gzip;q=0, *", "*;q=0", "identity"}) {
    EXPECT_FALSE(is_compressed(no)) << no;
  }
}

TEST_F(Web, AConnectionIsKeptForTheNextRequest) {
  const std::string replies =
      ask("GET /hello HTTP/1.1\r\nHost: localhost\r\n\r\nGET /none HTTP/1.1\r\nHost: localhost\r\nConnection: "
          "close\r\n\r\n");
  EXPECT_TRUE(replies.starts_with("HTTP/1.1 200 "));
  EXPECT_NE(replies.find("worldHTTP/1.1 404 "), std::string::npos);
}

TEST_F(Web, WhatIsNoPlainGetIsRefused) {
  EXPECT_TRUE(
      ask("DELETE /hello HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").starts_with("HTTP/1.1 405 "));
  EXPECT_TRUE(
      ask("GET /hello HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n\r\nhello").starts_with("HTTP/1.1 413 "));
  EXPECT_TRUE(ask("GET /hello HTTP/1.1\r\nX: " + std::string(20'000, 'x') + "\r\n\r\n").starts_with("HTTP/1.1 431 "));
  EXPECT_TRUE(ask("GET /ws HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").starts_with("HTTP/1.1 426 "));
  EXPECT_TRUE(ask("\x01\x02\x03 garbage\r\n\r\n").starts_with("HTTP/1.1 400 "));
}

TEST_F(Web, ARequestHasOneHostThatIsThisServersAndNoTransferCoding) {
  const auto status = [&](const std::string& headers) {
    return ask("GET /hello HTTP/1.1\r\nConnection: close\r\n" + headers + "\r\n").substr(9, 3);
  };
  EXPECT_EQ(status("Host: localhost\r\n"), "200");
  EXPECT_EQ(status("Host: 127.0.0.1:7421\r\n"), "200");
  EXPECT_EQ(status(""), "400");
  EXPECT_EQ(status("Host: localhost\r\nHost: localhost\r\n"), "400");
  EXPECT_EQ(status("Host:\r\n"), "421");
  EXPECT_EQ(status("Host: evil.example\r\n"), "421");
  EXPECT_EQ(status("Host: localhost\r\nTransfer-Encoding: gzip\r\n"), "400");
  EXPECT_EQ(status("Host: localhost\r\nTransfer-Encoding: identity\r\n"), "400");
  EXPECT_NE(status("Host: localhost\r\nTransfer-Encoding: chunked\r\nContent-Length: 3\r\n"), "200");
  EXPECT_TRUE(ask("GET /hello HTTP/1.0\r\n\r\n").starts_with("HTTP/1.0 400")) << "of the old version too";
}

// B7 of the list of attacks: a name of the attacker's that points here is of the same origin as itself.
TEST_F(Web, APageWhoseNameWasPointedHereMayNotUpgrade) {
  const std::string key = "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n";
  EXPECT_EQ(upgrade("Host: evil.example\r\nOrigin: http://evil.example\r\n" + key), "421");
  EXPECT_EQ(upgrade("Host: localhost\r\nHost: evil.example\r\nOrigin: http://evil.example\r\n" + key), "400");
  EXPECT_EQ(upgrade("Origin: http://evil.example\r\n" + key), "400");
}

TEST_F(SlowWeb, ASlowLorisIsClosed) {
  RawClient client(server_.http_port());
  client.send_bytes("GET /hello HTTP/1.1\r\nHost: localhost\r\n");
  EXPECT_EQ(client.read_rest(), "");  // and the rest of the request never comes
  EXPECT_TRUE(ask("GET /hello HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").starts_with("HTTP/1.1 200 "));
}

TEST_F(SlowWeb, AReplyHasTimeOfItsOwn) {
  RawClient client(server_.http_port());
  client.send_bytes("GET /late HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  EXPECT_TRUE(client.read_bytes(late_page_bytes)) << "none of it is missing";
}

TEST_F(Web, OnlyPagesOfThisServerMayUpgrade) {
  const std::string host = "localhost:" + std::to_string(server_.http_port());
  const std::string key = "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n";
  EXPECT_EQ(upgrade("Host: " + host + "\r\n" + key), "101") << "programs send no Origin";
  EXPECT_EQ(upgrade("Host: " + host + "\r\nOrigin: http://" + host + "\r\n" + key), "101");
  EXPECT_EQ(upgrade("Host: " + host + "\r\nOrigin: http://evil.example\r\n" + key), "403");
  EXPECT_EQ(upgrade("Host: " + host + "\r\nOrigin: null\r\n" + key), "403");
  EXPECT_NE(upgrade("Host: " + host + "\r\n"), "101") << "a WebSocket client has a key";
  EXPECT_EQ(upgrade("Host: " + host + "\r\nOrigin: http://" + host + "\r\nOrigin: http://evil.example\r\n" + key),
            "400");
}

TEST_F(Web, WhatFollowsAnUpgradeBeforeItsAnswerIsRefusedAndNotLost) {
  EXPECT_TRUE(ask("GET /ws HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
                  "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n\x82\x80"
                  "abcd")
                  .starts_with("HTTP/1.1 400 "));
}

TEST_F(Web, MessagesGoBothWays) {
  WebSocket client(server_.http_port());
  ASSERT_FALSE(client.write("hello"));
  EXPECT_EQ(client.read(), "hello");
  const std::string large(60'000, 'x');  // larger than the parts that it is sent in
  ASSERT_FALSE(client.write(large));
  EXPECT_EQ(client.read(), large);
  error_code error;
  client.stream().close(websocket::close_code::normal, error);
  EXPECT_FALSE(error);
  EXPECT_TRUE(server_.wait_closed(1).back().ok());
}

TEST_F(Web, AGoodbyeComesBeforeTheClose) {
  WebSocket client(server_.http_port());
  ASSERT_FALSE(client.write("end"));
  EXPECT_EQ(client.read(), "goodbye as asked");
  EXPECT_EQ(client.read(), "closed");
}

TEST_F(Web, ATextMessageIsMalformed) {
  WebSocket client(server_.http_port());
  client.stream().text(true);
  ASSERT_FALSE(client.write("hello"));
  EXPECT_TRUE(client.read().starts_with("goodbye "));
  EXPECT_EQ(server_.wait_closed(1).back().code(), base::StatusCode::malformed);
}

TEST_F(Web, ALargeMessageBeforeHelloIsMalformed) {
  WebSocket client(server_.http_port());
  client.write(std::string(base::message_bytes_max_before_hello + 1, 'x'));
  EXPECT_EQ(client.read(), "closed");
  EXPECT_EQ(client.stream().reason().code, websocket::close_code::too_big);
  EXPECT_EQ(server_.wait_closed(1).back().code(), base::StatusCode::malformed);
}

TEST_F(Web, TheLargestMessageIsTakenAndOneByteMoreIsNot) {
  WebSocket client(server_.http_port());
  ASSERT_FALSE(client.write("hello"));
  EXPECT_EQ(client.read(), "hello");
  const std::string largest(patient_limits().message_bytes_max, 'x');
  ASSERT_FALSE(client.write(largest));
  EXPECT_EQ(client.read(), largest);
  client.write(largest + "x");
  EXPECT_EQ(client.read(), "closed");
  EXPECT_EQ(client.stream().reason().code, websocket::close_code::too_big);
}

// B11 of the list of attacks: the connection stayed open for 13 s, until the time-out of a message that does not end.
TEST_F(Web, ALengthPastTheLimitEndsTheSessionBeforeItsBytesCome) {
  for (const std::string& length : {std::string("\x7f\x80\0\0\0\0\0\0\0", 9), std::string("\x7f\0\0\0\0\0\x10\0\0", 9),
                                    std::string("\x7f\x7f\xff\xff\xff\xff\xff\xff\xff", 9)}) {
    WebSocket client(server_.http_port());
    ASSERT_FALSE(client.write("hello"));
    EXPECT_EQ(client.read(), "hello");
    std::string head = "\x82" + length + "mask";
    head[1] = static_cast<char>(head[1] | 0x80);  // masked, as a client's are
    client.stream().next_layer().write_some(asio::buffer(head));
    EXPECT_EQ(client.read(), "closed") << "and no time-out of this server's is under ten minutes";
  }
}

TEST_F(SlowWeb, HalfAMessageThenSilence) {
  WebSocket client(server_.http_port());
  ASSERT_FALSE(client.write("hello"));
  EXPECT_EQ(client.read(), "hello");
  client.stream().write_some(false, asio::buffer("half", 4));
  EXPECT_TRUE(client.read().starts_with("goodbye "));
}

TEST_F(Web, GarbageInsteadOfWebSocketFrames) {
  WebSocket client(server_.http_port());
  client.stream().next_layer().write_some(asio::buffer(std::string(100, '\xFF')));
  EXPECT_EQ(client.read(), "closed");
  EXPECT_EQ(server_.wait_closed(1).back().code(), base::StatusCode::malformed);
}

Tls tls_of(const support::SelfSigned& certificate) {
  return {certificate.certificate_file(), certificate.key_file()};
}

class OverTls : public testing::Test {
 protected:
  OverTls() { client_context_.load_verify_file(certificate_.certificate_file()); }

  support::SelfSigned certificate_;
  EchoServer server_{patient_limits(), tls_of(certificate_)};
  asio::io_context io_;
  asio::ssl::context client_context_{asio::ssl::context::tls_client};
};

TEST_F(OverTls, MessagesGoBothWays) {
  asio::ssl::stream<Tcp::socket> client(io_, client_context_);
  client.set_verify_mode(asio::ssl::verify_peer);
  client.next_layer().connect(loopback(server_.tcp_port()));
  client.handshake(asio::ssl::stream_base::client);
  const std::string message = framed("hello").append(framed(std::string(60'000, 'x')));
  asio::write(client, asio::buffer(message));
  std::string echo(message.size(), '\0');
  asio::read(client, asio::buffer(echo));
  EXPECT_EQ(echo, message);
  error_code error;
  client.shutdown(error);
  EXPECT_TRUE(server_.wait_closed(1).back().ok());
}

TEST_F(OverTls, WebSocketMessagesGoBothWays) {
  websocket::stream<asio::ssl::stream<Tcp::socket>> client(io_, client_context_);
  client.next_layer().next_layer().connect(loopback(server_.http_port()));
  client.next_layer().handshake(asio::ssl::stream_base::client);
  client.handshake("localhost", "/ws");
  client.binary(true);
  client.write(asio::buffer("end", 3));
  beast::flat_buffer buffer;
  client.read(buffer);
  EXPECT_EQ(beast::buffers_to_string(buffer.data()), "goodbye as asked");
  error_code error;
  client.read(buffer, error);
  EXPECT_EQ(error, websocket::error::closed);
}

TEST_F(OverTls, PlainBytesEndTheConnectionAndNothingElse) {
  RawClient plain(server_.tcp_port());
  plain.send_message("hello");
  EXPECT_EQ(plain.read_rest(), framed("goodbye this port speaks TLS, and the client does not"));
  EXPECT_EQ(server_.wait_closed(1).front().code(), base::StatusCode::unsupported);
  RawClient plain_http(server_.http_port());
  plain_http.send_bytes("GET /hello HTTP/1.1\r\n\r\n");
  plain_http.read_rest();
  asio::ssl::stream<Tcp::socket> client(io_, client_context_);
  client.next_layer().connect(loopback(server_.tcp_port()));
  client.handshake(asio::ssl::stream_base::client);
  EXPECT_EQ(server_.wait_opened(2).size(), 2U) << "of the plain page request the owner never heard";
  server_.stop();
  EXPECT_EQ(server_.calls_out_of_order(), 0);
}

TEST_F(OverTls, AClientOfTls11IsRefused) {
  asio::ssl::context old(asio::ssl::context::tls_client);
  SSL_CTX_set_security_level(old.native_handle(), 0);
  SSL_CTX_set_max_proto_version(old.native_handle(), TLS1_1_VERSION);
  asio::ssl::stream<Tcp::socket> client(io_, old);
  client.next_layer().connect(loopback(server_.tcp_port()));
  error_code error;
  client.handshake(asio::ssl::stream_base::client, error);
  EXPECT_TRUE(error);
}

TEST(TlsFiles, AMissingOrBrokenFileIsNamed) {
  const support::SelfSigned good;
  Server server({}, {});
  const auto missing = server.listen_tcp("127.0.0.1:0", Tls{"/no/such/file.pem", good.key_file()});
  EXPECT_NE(missing.message().find("/no/such/file.pem"), std::string::npos) << missing.message();
  const auto swapped = server.listen_tcp("127.0.0.1:0", Tls{good.key_file(), good.key_file()});
  EXPECT_NE(swapped.message().find(good.key_file()), std::string::npos) << swapped.message();
  std::ofstream(good.key_file()) << "no key";
  const auto broken = server.listen_tcp("127.0.0.1:0", tls_of(good));
  EXPECT_NE(broken.message().find(good.key_file()), std::string::npos) << broken.message();
}

TEST(Listening, AWrongAddressIsNamed) {
  Server server({}, {});
  for (const char* address : {"localhost", "127.0.0.1:port", "127.0.0.1:70000", ":1", "[::1]"}) {
    const auto status = server.listen_tcp(address, {});
    EXPECT_FALSE(status.ok()) << address;
    EXPECT_NE(status.message().find(address), std::string::npos) << status.message();
  }
  ASSERT_TRUE(server.listen_tcp("127.0.0.1:0", {}).ok());
  const auto taken = server.listen_http(server.tcp_address(), {});
  EXPECT_EQ(taken.code(), base::StatusCode::unavailable);
}

}  // namespace
}  // namespace pneuma::net
