// Shows who may speak and how often: the token, the rate limit, the connection limit.
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include <unistd.h>

#include "raw_connection.h"
#include "served.h"

namespace pneuma::integration {
namespace {

class Trust : public Served {};

TEST_F(Trust, OnlyWhoKnowsTheTokenGetsIn) {
  const std::string file = testing::TempDir() + "pneuma-token-" + std::to_string(getpid());
  std::ofstream(file) << "open sesame\n";
  start({"--token-file", file});
  std::remove(file.c_str());
  client::ConnectOptions options;
  options.token = "open sesame";
  EXPECT_TRUE(connect(options).ping().ok());
  options.token = "open barley";
  const auto refused = client::Client::connect(server_->tcp_address(), options);
  EXPECT_EQ(refused.status().code(), base::StatusCode::unauthenticated);
  RawConnection none(server_->tcp_address());
  EXPECT_FALSE(none.say_hello());
  EXPECT_TRUE(none.ends());
}

TEST_F(Trust, TheTokenMayComeFromTheEnvironmentAndIsNeverEmpty) {
  ::setenv("PNEUMA_TOKEN", "open sesame", 1);
  start();
  ::setenv("PNEUMA_TOKEN", "", 1);
  const auto empty = support::run_program("pneuma-server", {"--listen", "127.0.0.1:0", "--http", "off"});
  ::unsetenv("PNEUMA_TOKEN");
  EXPECT_EQ(empty.exit_status, 1);
  EXPECT_EQ(empty.error_output, "pneuma-server: PNEUMA_TOKEN: holds no token\n");
  client::ConnectOptions options;
  options.token = "open sesame";
  EXPECT_TRUE(connect(options).ping().ok());
  EXPECT_EQ(client::Client::connect(server_->tcp_address()).status().code(), base::StatusCode::unauthenticated);
}

TEST_F(Trust, PastTheRateRequestsAreRefusedAndTheConnectionIsKept) {
  start({"--commands-per-s", "1", "--commands-burst", "5"});
  RawConnection raw(server_->tcp_address());
  ASSERT_TRUE(raw.say_hello());
  // In one go: hardly a second passes for the server while it reads them.
  constexpr std::uint64_t requests = 100;
  std::string pipeline;
  for (std::uint64_t id = 2; id < 2 + requests; ++id) {
    v1::ClientMessage message;
    message.set_request_id(id);
    message.mutable_list_worlds();
    pipeline += RawConnection::envelope(message.SerializeAsString());
  }
  ASSERT_TRUE(raw.send(pipeline));
  std::uint64_t refused = 0;
  for (std::uint64_t id = 2; id < 2 + requests; ++id) {
    const auto reply = raw.receive();
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->request_id(), id);
    if (!reply->has_error()) continue;
    ++refused;
    EXPECT_EQ(reply->error().code(), v1::Error::LIMIT_EXCEEDED);
    EXPECT_GT(reply->error().retry_after_s(), 0.0);
    EXPECT_LE(reply->error().retry_after_s(), 1.0);
  }
  EXPECT_GE(refused, requests / 2);
  EXPECT_LE(refused, requests - 4) << "the burst is granted";
  EXPECT_TRUE(client::Client::connect(server_->tcp_address()).ok()) << "another client has its own rate";
}

TEST_F(Trust, OneWorldTooManyIsRefused) {
  start({"--worlds-max", "2"});
  client::Client client = connect();
  ASSERT_TRUE(client.create_builtin("bouncing-ball").ok());
  ASSERT_TRUE(client.create_builtin("bouncing-ball").ok());
  const auto third = client.create_builtin("bouncing-ball");
  EXPECT_EQ(third.status().code(), base::StatusCode::limit_exceeded);
  ASSERT_TRUE(client.destroy_world("bouncing-ball").ok());
  EXPECT_TRUE(client.create_builtin("bouncing-ball").ok());
}

TEST_F(Trust, OneConnectionTooManyIsEnded) {
  start({"--connections-per-address-max", "2"});
  client::Client first = connect();
  client::Client second = connect();
  RawConnection third(server_->tcp_address());
  EXPECT_FALSE(third.say_hello());
  EXPECT_TRUE(first.ping().ok());
  EXPECT_TRUE(second.ping().ok());
}

}  // namespace
}  // namespace pneuma::integration
