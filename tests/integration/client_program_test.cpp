// Shows the `pneuma` program against a real server.
#include <google/protobuf/util/message_differencer.h>

#include "served.h"
#include "support/self_signed.h"

namespace pneuma::integration {
namespace {

using support::Finished;

class ClientProgram : public Served {
 protected:
  [[nodiscard]] Finished pneuma(std::vector<std::string> arguments, const std::string& input = {}) const {
    arguments.insert(arguments.begin(), {"--server", server_->tcp_address()});
    return support::run_program("pneuma", arguments, input);
  }
};

// Worlds that have run: rigid bodies and gas are no longer where the scene file had them.
TEST_F(ClientProgram, WhatScenePrintsMakesTheSameSceneAgain) {
  start();
  client::Client client = connect();
  create(client, two_balls(), "w", true);
  ASSERT_TRUE(client.step("w", 30).ok());
  ASSERT_TRUE(client.create_builtin("hand", "hand", true).ok());
  for (const char* world : {"w", "hand"}) {
    for (const bool json : {false, true}) {
      SCOPED_TRACE(std::string(world) + (json ? " --json" : ""));
      std::vector<std::string> ask{"scene", world};
      if (json) ask.insert(ask.begin(), "--json");
      const Finished printed = pneuma(ask);
      ASSERT_EQ(printed.exit_status, 0) << printed.error_output;
      const Finished created = pneuma({"create", "-", "--name", "again", "--paused"}, printed.output);
      ASSERT_EQ(created.exit_status, 0) << created.error_output;
      const auto first = client.scene(world);
      const auto again = client.scene("again");
      ASSERT_TRUE(first.ok() && again.ok());
      google::protobuf::util::MessageDifferencer compare;
      compare.set_float_comparison(google::protobuf::util::MessageDifferencer::APPROXIMATE);  // normals made unit again
      std::string difference;
      compare.ReportDifferencesToString(&difference);
      EXPECT_TRUE(compare.Compare(first->scene(), again->scene())) << difference;
      ASSERT_TRUE(client.destroy_world("again").ok());
    }
  }
}

// A whole session over TLS, and what each mistake about it is told as.
TEST_F(ClientProgram, SpeaksTlsAndSaysWhereOneSideAloneDoes) {
  const support::SelfSigned certificate;
  start({"--tls-cert", certificate.certificate_file(), "--tls-key", certificate.key_file()});
  const std::string port = server_->tcp_address().substr(server_->tcp_address().rfind(':'));
  const std::vector<std::string> trusted{"--tls", "--ca", certificate.certificate_file()};
  const auto worlds = [&](const std::string& address, std::vector<std::string> flags) {
    flags.insert(flags.end(), {"--server", address, "worlds"});
    return support::run_program("pneuma", flags);
  };
  const Finished well = worlds("localhost" + port, trusted);
  EXPECT_EQ(well.exit_status, 0) << well.error_output;

  const Finished plain = worlds("localhost" + port, {});
  EXPECT_EQ(plain.exit_status, 1);
  EXPECT_NE(plain.error_output.find("TLS"), std::string::npos) << plain.error_output;
  const Finished stranger = worlds("localhost" + port, {"--tls"});
  EXPECT_NE(stranger.error_output.find("self-signed"), std::string::npos) << stranger.error_output;
  const Finished elsewhere = worlds("127.0.0.1" + port, trusted);
  EXPECT_NE(elsewhere.error_output.find("host name"), std::string::npos) << elsewhere.error_output;

  start();
  const Finished alone = pneuma({"--tls", "worlds"});
  EXPECT_NE(alone.error_output.find("TLS: the server does not speak it"), std::string::npos) << alone.error_output;
}

}  // namespace
}  // namespace pneuma::integration
