// Shows how tokens come and go: made, listed and revoked by the program, while a server runs that takes them.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <sys/stat.h>

#include "raw_connection.h"
#include "served.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace pneuma::integration {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::seconds tokens_known_within{5};  // docker/README.md, "Who may do what"

class Tokens : public Served {
 protected:
  /// What `pneuma-server token` puts out.
  std::string command(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "token");
    arguments.insert(arguments.end(), {"--tokens", file_});
    const auto finished = support::run_program("pneuma-server", arguments);
    EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
    return finished.output;
  }
  std::string make(const std::string& role, const std::string& worlds = "*", const std::string& expires = "1h") const {
    const std::string line = command({"new", "--role", role, "--world", worlds, "--expires", expires});
    return line.substr(0, line.size() - 1);
  }
  /// The id of the file's only token.
  [[nodiscard]] std::string only_id() const {
    const std::string list = command({"list"});
    return list.substr(list.find('\n') + 1, 8);
  }
  [[nodiscard]] bool is_taken(const std::string& token) const {
    return RawConnection(server_->tcp_address()).say_hello(token);
  }
  /// True where the log has the line in time.
  [[nodiscard]] bool is_logged(const std::string& line) const {
    const auto deadline = steady_clock::now() + patience;
    while (steady_clock::now() < deadline) {
      if (server_->error_output().find(line) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

 private:
  support::TemporaryFolder folder_;

 protected:
  const std::string file_ = folder_ / "tokens";
};

TEST_F(Tokens, AreShownOnceAndListedWithoutTheirSecret) {
  const std::string secret = make("edit", "lab-*");
  EXPECT_EQ(secret.size(), 64U);
  const std::string list = command({"list"});
  EXPECT_EQ(list.find(secret), std::string::npos);
  EXPECT_NE(list.find("  edit   lab-*   20"), std::string::npos) << list;
  start({"--tokens", file_});
  EXPECT_TRUE(is_taken(secret));
  EXPECT_FALSE(is_taken(""));
}

TEST_F(Tokens, TheProgramRefusesWhatIsNoToken) {
  const auto exit_status = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "token");
    return support::run_program("pneuma-server", arguments).exit_status;
  };
  EXPECT_EQ(exit_status({}), 2);
  EXPECT_EQ(exit_status({"new", "--tokens", file_}), 2) << "a role is chosen";
  EXPECT_EQ(exit_status({"new", "--tokens", file_, "--role", "boss"}), 2);
  EXPECT_EQ(exit_status({"new", "--tokens", file_, "--role", "view", "--world", "a/*"}), 2);
  EXPECT_EQ(exit_status({"new", "--tokens", file_, "--role", "view", "--expires", "soon"}), 2);
  EXPECT_EQ(exit_status({"list", "--tokens", file_}), 1) << "there is no file";
  make("view");
  EXPECT_EQ(exit_status({"revoke", "--tokens", file_, "00000000"}), 1) << "there is no such token";
}

TEST_F(Tokens, ANewOneIsTakenAndARevokedOneEndsItsSessions) {
  const std::string first = make("view");
  start({"--tokens", file_});
  RawConnection session(server_->tcp_address());
  ASSERT_TRUE(session.say_hello(first));
  const std::string id = only_id();
  const std::string second = make("view");
  ASSERT_TRUE(is_logged("tokens=2 of"));
  RawConnection stays(server_->tcp_address());
  ASSERT_TRUE(stays.say_hello(second));

  command({"revoke", id});
  const auto revoked = steady_clock::now();
  EXPECT_TRUE(session.ends());
  EXPECT_LT(steady_clock::now() - revoked, tokens_known_within);
  EXPECT_EQ(session.goodbye(), v1::Error::UNAUTHENTICATED);
  EXPECT_FALSE(is_taken(first));
  v1::ClientMessage ping;
  ping.set_request_id(5);
  ping.mutable_ping()->set_nonce(1);
  ASSERT_TRUE(stays.send(ping));
  EXPECT_TRUE(stays.receive_reply(5)) << "the other one's session goes on";
}

TEST_F(Tokens, AnExpiredOneEndsItsSessions) {
  const std::string secret = make("view", "*", "10s");
  start({"--tokens", file_});
  RawConnection session(server_->tcp_address());
  ASSERT_TRUE(session.say_hello(secret));
  EXPECT_TRUE(session.ends());
  EXPECT_EQ(session.goodbye(), v1::Error::UNAUTHENTICATED);
  EXPECT_FALSE(is_taken(secret));
  EXPECT_NE(command({"list"}).find("(expired)"), std::string::npos);
}

TEST_F(Tokens, AFileThatIsBrokenLeavesTheTokensOfBefore) {
  const std::string secret = make("view");
  start({"--tokens", file_});
  RawConnection session(server_->tcp_address());
  ASSERT_TRUE(session.say_hello(secret));
  std::ofstream(file_, std::ios::app) << "boss\n";
  ASSERT_TRUE(is_logged("/tokens:4: is not ID ROLE WORLDS EXPIRES DIGEST; the tokens of before stay"))
      << server_->error_output();
  EXPECT_TRUE(is_taken(secret));
  // And at a start it is an error.
  const auto finished = support::run_program(
      "pneuma-server", {"--listen", "127.0.0.1:0", "--http", "off", "--log-level", "off", "--tokens", file_});
  EXPECT_EQ(finished.exit_status, 1);
  EXPECT_NE(finished.error_output.find("/tokens:4: is not ID"), std::string::npos) << finished.error_output;
}

// To read a pipe that nobody writes to would wait for ever.
TEST_F(Tokens, APipeInPlaceOfTheFileIsNotWaitedFor) {
  const std::string secret = make("view");
  start({"--tokens", file_});
  std::filesystem::remove(file_);
  ASSERT_EQ(::mkfifo(file_.c_str(), 0600), 0);
  ASSERT_TRUE(is_logged("/tokens: is no regular file; the tokens of before stay")) << server_->error_output();
  EXPECT_TRUE(is_taken(secret));
  const auto status = server_->stop();
  ASSERT_TRUE(status.ok()) << status.status().message();
  EXPECT_EQ(*status, 0);
}

TEST_F(Tokens, AreReadAgainWhenAsked) {
  make("view");
  start({"--tokens", file_});
  server_->send_signal(SIGHUP);
  EXPECT_TRUE(is_logged("tokens=1 of"));
  EXPECT_TRUE(is_logged("read again"));
}

TEST_F(Tokens, TheTokenOfTheTokenFileIsOneMore) {
  const std::string view = make("view");
  const std::string file = file_ + "-admin";
  std::ofstream(file) << "open sesame\n";
  start({"--tokens", file_, "--token-file", file});
  client::ConnectOptions options;
  options.token = "open sesame";
  EXPECT_EQ(connect(options).welcome().role(), v1::Welcome::ADMIN);
  options.token = view;
  EXPECT_EQ(connect(options).welcome().role(), v1::Welcome::VIEW);
  command({"revoke", only_id()});
  ASSERT_TRUE(is_logged("read again"));
  options.token = "open sesame";
  EXPECT_TRUE(connect(options).ping().ok());
}

}  // namespace
}  // namespace pneuma::integration
