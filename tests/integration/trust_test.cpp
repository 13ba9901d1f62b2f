// Shows who may speak and how often: the token, the rate limit, the connection limit.
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>
#include <vector>

#include <unistd.h>

#include "raw_connection.h"
#include "served.h"
#include "support/self_signed.h"
#include "support/temporary_folder.h"

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

TEST_F(Trust, NobodyServesOthersWithoutATokenUnawares) {
  const auto refused = [](std::vector<std::string> arguments, const std::string& says) {
    arguments.insert(arguments.begin(), {"--listen", "127.0.0.1:0", "--http", "off", "--log-level", "off"});
    const auto finished = support::run_program("pneuma-server", arguments);
    EXPECT_EQ(finished.exit_status, 1);
    EXPECT_TRUE(finished.error_output.starts_with("pneuma-server: " + says + ": others than this machine reach it"))
        << finished.error_output;
    EXPECT_NE(finished.error_output.find("--insecure"), std::string::npos) << finished.error_output;
  };
  refused({"--listen", "0.0.0.0:0"}, "--listen 0.0.0.0:0");
  refused({"--http", "0.0.0.0:0"}, "--http 0.0.0.0:0");
  refused({"--listen", "0.0.0.0:0", "--http", "0.0.0.0:0"}, "--listen 0.0.0.0:0, --http 0.0.0.0:0");

  const auto serves = [this](const std::string& token) {
    const std::string port = server_->tcp_address().substr(server_->tcp_address().rfind(':'));
    return RawConnection("127.0.0.1" + port).say_hello(token);
  };
  start({"--listen", "0.0.0.0:0", "--insecure"});
  EXPECT_TRUE(serves(""));
  ::setenv("PNEUMA_TOKEN", "open sesame", 1);
  start({"--listen", "0.0.0.0:0"});
  ::unsetenv("PNEUMA_TOKEN");
  EXPECT_TRUE(serves("open sesame"));
  EXPECT_FALSE(serves(""));
}

TEST_F(Trust, ACertificateIsReadAgainWhenAskedAndABadOneChangesNothing) {
  const support::SelfSigned before;
  const support::SelfSigned after;
  const support::TemporaryFolder folder;
  const std::string certificate = folder / "certificate.pem";
  const std::string key = folder / "key.pem";
  const auto put = [&](const support::SelfSigned& from) {
    constexpr auto over = std::filesystem::copy_options::overwrite_existing;
    std::filesystem::copy_file(from.certificate_file(), certificate, over);
    std::filesystem::copy_file(from.key_file(), key, over);
  };
  put(before);
  start({"--tls-cert", certificate, "--tls-key", key});
  const auto shows = [&](const support::SelfSigned& expected) {
    client::ConnectOptions options;
    options.tls = true;
    options.ca_file = expected.certificate_file();
    options.connect_timeout = patience;
    return client::Client::connect("localhost" + server_->tcp_address().substr(server_->tcp_address().rfind(':')),
                                   options);
  };
  const auto is_logged = [this](const std::string& line) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < deadline) {
      if (server_->error_output().find(line) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  };
  auto stays = shows(before);
  ASSERT_TRUE(stays.ok()) << stays.status().message();

  put(after);
  EXPECT_FALSE(shows(after).ok()) << "nobody asked for it yet";
  server_->send_signal(SIGHUP);
  ASSERT_TRUE(is_logged("read again"));
  EXPECT_TRUE(shows(after).ok());
  EXPECT_FALSE(shows(before).ok());
  EXPECT_TRUE(stays->ping().ok()) << "what was open goes on";

  std::ofstream(certificate) << "no certificate\n";
  server_->send_signal(SIGHUP);
  ASSERT_TRUE(is_logged(certificate + ": no certificate in PEM form"));
  EXPECT_TRUE(shows(after).ok());
}

TEST_F(Trust, PastTheRateRequestsAreRefusedAndTheConnectionIsKept) {
  start({"--commands-per-s", "1", "--commands-burst", "5"});
  RawConnection raw(server_->tcp_address());
  ASSERT_TRUE(raw.say_hello());
  // In one go: hardly a second passes for the server while it reads them.
  constexpr std::uint64_t requests = 100;
  ASSERT_TRUE(raw.send(RawConnection::lists(2, requests)));
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
  EXPECT_TRUE(client::Client::connect(server_->tcp_address()).ok()) << "who comes is let in, whatever others asked for";
}

/// Asks for the list `count` times on each connection, in one go; how often it is given.
int lists_given(std::vector<std::unique_ptr<RawConnection>>& connections, std::uint64_t count) {
  for (const auto& connection : connections) {
    std::string pipeline;
    for (std::uint64_t id = 2; id < 2 + count; ++id) {
      v1::ClientMessage message;
      message.set_request_id(id);
      message.mutable_list_worlds();
      pipeline += RawConnection::envelope(message.SerializeAsString());
    }
    EXPECT_TRUE(connection->send(pipeline));
  }
  int given = 0;
  for (const auto& connection : connections) {
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto reply = connection->receive();
      EXPECT_TRUE(reply);
      if (reply && reply->has_world_list()) ++given;
    }
  }
  return given;
}

TEST_F(Trust, ManyConnectionsOfAClientGetNoMoreThanOne) {
  start({"--commands-per-s", "1", "--commands-burst", "50"});
  std::vector<std::unique_ptr<RawConnection>> connections;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 32; ++i) {
    connections.push_back(std::make_unique<RawConnection>(server_->tcp_address()));
    ASSERT_TRUE(connections.back()->say_hello());
  }
  const int given = lists_given(connections, 10);
  const double passed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_LE(given + 32, 50 + passed_s + 1) << "each hello took one";
  EXPECT_GE(given + 32, 50);
}

// B11 of the list of attacks: 5,400 a second were looked at.
TEST_F(Trust, GuessesOfTheTokenAreFewOverEitherWay) {
  ::setenv("PNEUMA_TOKEN", "open sesame", 1);
  start({"--connections-per-address-max", "1000"});
  ::unsetenv("PNEUMA_TOKEN");
  const auto guess_by_tcp = [this](int i) {
    RawConnection raw(server_->tcp_address());
    v1::ClientMessage message;
    message.set_request_id(1);
    message.mutable_hello()->set_protocol_version(1);
    message.mutable_hello()->set_token("guess " + std::to_string(i));
    raw.send(message);
    const auto reply = raw.receive();
    EXPECT_TRUE(reply);
    if (reply && reply->error().code() == v1::Error::LIMIT_EXCEEDED) {
      EXPECT_GT(reply->error().retry_after_s(), 0.0);
    }
    return reply && reply->error().code() == v1::Error::UNAUTHENTICATED;
  };
  const auto guess_by_http = [this](int i) {
    RawConnection raw(server_->http_address());
    raw.send("GET /worlds HTTP/1.0\r\nHost: localhost\r\nAuthorization: Bearer web " + std::to_string(i) + "\r\n\r\n");
    const std::string reply = raw.receive_to_end();
    EXPECT_TRUE(reply.starts_with("HTTP/1.0 401 ") || reply.starts_with("HTTP/1.0 429 ")) << reply;
    return reply.starts_with("HTTP/1.0 401 ");
  };
  const auto begin = std::chrono::steady_clock::now();
  int looked_at = 0;
  for (int i = 0; i < 50; ++i) looked_at += (guess_by_tcp(i) ? 1 : 0) + (guess_by_http(i) ? 1 : 0);
  const double passed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_GE(looked_at, 5);
  EXPECT_LE(looked_at, 6 + passed_s) << "five at once, then one a second at most, and more and more seldom";
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
