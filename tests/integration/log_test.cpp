// Shows that the server's log is its own: nobody waits for who reads it, and no client writes a line of it.
#include <sstream>

#include <boost/json.hpp>

#include "raw_connection.h"
#include "served.h"

namespace pneuma::integration {
namespace {

class Log : public Served {
 protected:
  [[nodiscard]] std::string page(const std::string& path) const {
    RawConnection connection(server_->http_address());
    EXPECT_TRUE(connection.send("GET " + path + " HTTP/1.0\r\nHost: localhost\r\n\r\n"));
    return connection.receive_to_end();
  }
};

// B10 of the list of attacks: standard error is a pipe that is full and that nobody reads. Each connection is three
// lines; so many of them are more than may wait.
TEST_F(Log, NobodyWaitsForWhoReadsIt) {
  auto server = support::ServerProcess::start({"--connections-per-address-max", "1000", "--scene", "bouncing-ball"},
                                              patience, support::ErrorOutput::full);
  ASSERT_TRUE(server.ok()) << server.status().message();
  server_.emplace(std::move(*server));
  for (int i = 0; i < 1'500; ++i) {
    RawConnection connection(server_->tcp_address());
    ASSERT_TRUE(connection.say_hello()) << "connection " << i;
  }
  EXPECT_TRUE(page("/healthz").starts_with("HTTP/1.0 200"));
  const std::string metrics = page("/metrics");
  const std::size_t counted = metrics.find("\npneuma_log_lines_dropped_total ");
  ASSERT_NE(counted, std::string::npos) << metrics;
  const std::size_t value = metrics.find(' ', counted) + 1;
  EXPECT_GT(std::stod(metrics.substr(value)), 0.0);
  const auto status = server_->stop();
  ASSERT_TRUE(status.ok()) << status.status().message();
  EXPECT_EQ(*status, 0);
}

TEST_F(Log, AClientsNameCannotForgeALine) {
  start();
  client::ConnectOptions options;
  options.client_name =
      "me\" said hello\nsession=7 \xe2\x80\xae"
      "closed";
  EXPECT_TRUE(connect(options).ping().ok());
  ASSERT_TRUE(server_->stop().ok());
  const std::string log = server_->error_output();
  EXPECT_NE(log.find(R"(client="me' said hello\x0asession=7 \xe2\x80\xaeclosed" said hello)"), std::string::npos)
      << log;
  EXPECT_EQ(log.find("\nsession=7"), std::string::npos);
}

TEST_F(Log, OneThatComesAndGoesIsToldTenTimesAndCounted) {
  start();
  for (int i = 0; i < 50; ++i) RawConnection(server_->tcp_address()).say_hello();
  EXPECT_NE(page("/metrics").find("\npneuma_log_lines_dropped_total "), std::string::npos);
  ASSERT_TRUE(server_->stop().ok());
  const std::string log = server_->error_output();
  std::size_t hellos = 0;
  for (std::size_t at = 0; (at = log.find(" said hello", at)) != std::string::npos; ++at) ++hellos;
  EXPECT_EQ(hellos, 11U) << "ten, and the count of the rest\n" << log;
  EXPECT_NE(log.find("dropped_lines=40 like: session= client= said hello"), std::string::npos) << log;
}

TEST_F(Log, InJsonEachLineIsAnObject) {
  start({"--log-format", "json", "--scene", "bouncing-ball"});
  client::ConnectOptions options;
  options.client_name = "say \"hi\"\n\\";
  EXPECT_TRUE(connect(options).ping().ok());
  ASSERT_TRUE(server_->stop().ok());
  std::istringstream lines(server_->error_output());
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    boost::system::error_code error;
    const auto object = boost::json::parse(line, error);
    ASSERT_FALSE(error) << line;
    for (const char* key : {"time", "level", "text"}) EXPECT_TRUE(object.at(key).is_string()) << line;
  }
  EXPECT_GE(count, 4U);
}

}  // namespace
}  // namespace pneuma::integration
