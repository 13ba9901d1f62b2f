// Shows the HTTP side: the pages, and the protocol over WebSocket (Beast's own client, one message a WebSocket
// message).
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <vector>

#include <boost/asio.hpp>
#include <boost/beast.hpp>
#include <sys/resource.h>

#include "raw_connection.h"
#include "served.h"
#include "support/program.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"
#include "web_socket.h"

namespace pneuma::integration {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;

class Web : public Served {
 protected:
  void SetUp() override { start({"--scene", "bouncing-ball"}); }

  asio::ip::tcp::endpoint endpoint() const { return endpoint_of(server_->http_address()); }

  http::response<http::string_body> get(const std::string& target) {
    beast::tcp_stream stream(io_);
    stream.connect(endpoint());
    http::request<http::empty_body> request(http::verb::get, target, 11);
    request.set(http::field::host, "localhost");
    request.set(http::field::connection, "close");
    http::write(stream, request);
    beast::flat_buffer buffer;
    http::response<http::string_body> response;
    http::read(stream, buffer, response);
    return response;
  }

  asio::io_context io_;
};

v1::ClientMessage hello() {
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_hello()->set_protocol_version(1);
  return message;
}

TEST_F(Web, ThePagesAnswer) {
  const auto worlds = get("/worlds");
  EXPECT_EQ(worlds.result_int(), 200U);
  EXPECT_NE(worlds.body().find("bouncing-ball"), std::string::npos);
  EXPECT_EQ(get("/healthz").result_int(), 200U);
  EXPECT_EQ(get("/nothing").result_int(), 404U);
}

TEST_F(Web, TheFilesOfAWebFolderAreServedAndNothingBesideThem) {
  const support::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "web");
  std::ofstream(folder / "secret.txt") << "not served";
  std::ofstream(folder / "web/index.html") << "<!doctype html>";
  std::ofstream(folder / "web/page.js") << "'use strict';";
  start({"--scene", "bouncing-ball", "--web-dir", folder / "web"});
  const auto page = get("/");
  EXPECT_EQ(page.body(), "<!doctype html>");
  EXPECT_EQ(page[http::field::content_type], "text/html; charset=utf-8");
  EXPECT_EQ(get("/page.js?version=1").body(), "'use strict';");
  EXPECT_EQ(get("/../secret.txt").result_int(), 404U);
  EXPECT_EQ(get("/%2e%2e/secret.txt").result_int(), 404U);
  start({"--web-dir", "off"});
  EXPECT_NE(get("/").body().find("0 worlds"), std::string::npos);
}

TEST_F(Web, AWebFolderThatIsNoneStopsTheServerAtItsStart) {
  const support::TemporaryFolder folder;
  const auto finished = support::run_program(
      "pneuma-server", {"--listen", "127.0.0.1:0", "--http", "127.0.0.1:0", "--web-dir", folder / "none"});
  EXPECT_EQ(finished.exit_status, 1);
  EXPECT_NE(finished.error_output.find("--web-dir"), std::string::npos) << finished.error_output;
}

// B7 of the list of attacks: a page's own name may be made to point here.
TEST_F(Web, TheServerAnswersToItsNamesAlone) {
  const auto status_for = [this](const std::string& host) {
    RawConnection connection(server_->http_address());
    EXPECT_TRUE(connection.send("GET /worlds HTTP/1.0\r\nHost: " + host + "\r\n\r\n"));
    return connection.receive_to_end().substr(9, 3);
  };
  EXPECT_EQ(status_for("localhost"), "200");
  EXPECT_EQ(status_for("pneuma.example"), "421");
  start({"--allow-host", "pneuma.example", "--allow-host", "other.example"});
  EXPECT_EQ(status_for("pneuma.example"), "200");
  EXPECT_EQ(status_for("other.example:8080"), "200");
  EXPECT_EQ(status_for("evil.example"), "421");
  start({"--http", "localhost:0", "--allow-host", "*"});
  EXPECT_EQ(status_for("evil.example"), "200");
}

// B11: whoever watches the server would take it for dead when all that is wrong is that it is full.
TEST_F(Web, HealthIsToldWhenTheServerIsFull) {
  start({"--connections-per-address-max", "1"});
  client::Client client = connect();
  EXPECT_EQ(get("/healthz").result_int(), 200U);
  EXPECT_EQ(get("/worlds").result_int(), 503U);
  EXPECT_EQ(get("/ws").result_int(), 503U);
}

// B11: with the descriptors at their limit it was not answered at all.
TEST_F(Web, HealthIsToldWhenThereAreNoDescriptorsLeft) {
  if (support::is_address_sanitized) GTEST_SKIP() << "the undefined-behaviour sanitizer needs descriptors itself";
  start({"--connections-per-address-max", "1000", "--threads", "1"});
  // What the server opens when it is first asked is there before they are counted.
  std::vector<std::unique_ptr<RawConnection>> clients;
  const auto gets_in = [&] {
    return clients.emplace_back(std::make_unique<RawConnection>(server_->tcp_address()))->say_hello();
  };
  ASSERT_TRUE(gets_in());
  EXPECT_EQ(get("/worlds").result_int(), 200U);
  const auto files =
      std::distance(std::filesystem::directory_iterator("/proc/" + std::to_string(server_->pid()) + "/fd"),
                    std::filesystem::directory_iterator());
  const rlim_t few = static_cast<rlim_t>(files) + 8;
  const rlimit tight{few, few};
  ASSERT_EQ(::prlimit(server_->pid(), RLIMIT_NOFILE, &tight, nullptr), 0);
  while (clients.size() < 100 && gets_in()) {
  }
  ASSERT_LT(clients.size(), 100U) << "none is left";
  for (int i = 0; i < 20; ++i) EXPECT_EQ(get("/healthz").result_int(), 200U);
  EXPECT_EQ(get("/worlds").result_int(), 503U);
  clients.resize(1);
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!gets_in() && std::chrono::steady_clock::now() < deadline) clients.pop_back();
  EXPECT_TRUE(clients.front()->send(hello())) << "who was in stays in";
  EXPECT_EQ(get("/worlds").result_int(), 200U);
}

TEST_F(Web, MetricsCountWhatHappens) {
  client::Client client = connect();
  ASSERT_TRUE(client.subscribe("bouncing-ball").ok());
  ASSERT_TRUE(await_frame(client));
  EXPECT_FALSE(client.stats("nowhere").ok());
  const std::string text = get("/metrics").body();
  for (const char* line :
       {"pneuma_worlds 1", "pneuma_sessions 1", "pneuma_ticks_total", "pneuma_step_seconds_bucket",
        "pneuma_queue_bytes", "pneuma_slipped_seconds_total", "pneuma_frames_sent_total", "pneuma_frames_dropped_total",
        "pneuma_frame_bytes_total", "pneuma_frame_vertices_total", "pneuma_frame_queue_seconds",
        "pneuma_encode_seconds_sum", "pneuma_commands_total{kind=\"subscribe\",result=\"ok\"} 1",
        "pneuma_commands_total{kind=\"get_stats\",result=\"NOT_FOUND\"} 1"}) {
    EXPECT_NE(text.find(line), std::string::npos) << line << "\n" << text;
  }
}

TEST_F(Web, AWebSocketSpeaksTheSameProtocol) {
  WebSocket socket(io_, endpoint());
  socket.send(hello());
  EXPECT_TRUE(socket.receive().has_welcome());
  v1::ClientMessage subscribe;
  subscribe.set_request_id(2);
  subscribe.mutable_subscribe()->set_world("bouncing-ball");
  socket.send(subscribe);
  std::string order;
  while (order.find("frame delta") == std::string::npos) {
    const v1::ServerMessage message = socket.receive();
    if (message.has_subscribed()) order += "subscribed ";
    if (message.has_topology()) order += "topology ";
    if (message.has_layout()) order += "layout ";
    if (message.has_frame()) order += message.frame().has_base_tick() ? "frame delta" : "frame key ";
  }
  EXPECT_TRUE(order.starts_with("subscribed topology layout frame key ")) << order;
}

TEST_F(Web, AWebSocketMustSayHelloToo) {
  WebSocket socket(io_, endpoint());
  v1::ClientMessage list;
  list.set_request_id(1);
  list.mutable_list_worlds();
  socket.send(list);
  EXPECT_EQ(socket.receive().goodbye().reason().code(), v1::Error::UNAUTHENTICATED);
  beast::flat_buffer buffer;
  beast::error_code error;
  socket.stream().read(buffer, error);
  EXPECT_TRUE(error);
}

TEST_F(Web, HttpOffIsOff) {
  start({"--http", "off"});
  EXPECT_EQ(server_->http_address(), "off");
  EXPECT_TRUE(connect().ping().ok());
}

}  // namespace
}  // namespace pneuma::integration
