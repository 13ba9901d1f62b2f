// Shows the program's manners: flags, exit codes, one line for what went wrong, the health check.
#include <algorithm>
#include <cstdio>
#include <fstream>

#include <unistd.h>

#include "served.h"
#include "support/closed_port.h"
#include "support/temporary_folder.h"

namespace pneuma::integration {
namespace {

using support::run_program;

class ServerProgram : public Served {
 protected:
  static std::string temporary_file(const std::string& name, const std::string& text) {
    const std::string path = testing::TempDir() + "pneuma-" + std::to_string(getpid()) + "-" + name;
    std::ofstream(path) << text;
    return path;
  }

  /// Fails with exit status 1 and one last line on standard error that says `says`.
  static void expect_failure(const std::vector<std::string>& arguments, const std::string& says) {
    std::vector<std::string> all{"--listen", "127.0.0.1:0", "--http", "127.0.0.1:0", "--log-level", "off"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const auto finished = run_program("pneuma-server", all);
    EXPECT_EQ(finished.exit_status, 1);
    EXPECT_EQ(std::count(finished.error_output.begin(), finished.error_output.end(), '\n'), 1) << finished.error_output;
    EXPECT_NE(finished.error_output.find(says), std::string::npos) << finished.error_output;
    EXPECT_EQ(finished.output, "");
  }
};

TEST_F(ServerProgram, VersionAndHelp) {
  const auto version = run_program("pneuma-server", {"--version"});
  EXPECT_EQ(version.exit_status, 0);
  EXPECT_TRUE(version.output.starts_with("pneuma-server ")) << version.output;
  const auto help = run_program("pneuma-server", {"--help"});
  EXPECT_EQ(help.exit_status, 0);
  for (const char* flag : {"--listen", "--http", "--scene", "--data-dir", "--threads", "--token-file", "--tls-cert",
                           "--tls-key", "--config", "--log-level", "--health", "--isa", "--version"}) {
    EXPECT_NE(help.output.find(flag), std::string::npos) << flag;
  }
}

TEST_F(ServerProgram, TheReadyLineLinksThePageWhereThereIsOne) {
  const support::TemporaryFolder page;
  std::ofstream(page / "index.html") << "<!doctype html>";
  const auto ready = [](const std::string& web_dir) {
    auto server = support::Program::start(
        support::program_path("pneuma-server"),
        {"--listen", "127.0.0.1:0", "--http", "127.0.0.1:0", "--web-dir", web_dir, "--log-level", "off"});
    EXPECT_TRUE(server.ok());
    return *server->next_line(patience);
  };
  const std::string linked = ready(page.path());
  const std::string address = linked.substr(linked.find("http=") + 5, linked.find(" page=") - linked.find("http=") - 5);
  EXPECT_TRUE(linked.ends_with(" page=http://" + address)) << linked;
  EXPECT_EQ(ready("off").find("page="), std::string::npos);
}

TEST_F(ServerProgram, BadUsageExitsTwo) {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"--no-such-flag"},
                                             {"--threads", "many"},
                                             {"--threads", "-1"},
                                             {"--checkpoint-interval-s", "0"},
                                             {"--commands-per-s", "nan"},
                                             {"--ping-interval-ms", "0"},
                                             {"--worlds-max", "0"},
                                             {"--isa", "v5"},
                                             {"--log-level", "loud"},
                                             {"--tls-cert", "x.pem"},
                                             {"--config", "/no/such/file"},
                                             {"--listen", "foo"},
                                             {"--listen", "here:70000"},
                                             {"--http", "on"},
                                             {"extra"}}) {
    const auto finished = run_program("pneuma-server", arguments);
    EXPECT_EQ(finished.exit_status, 2) << arguments[0];
    EXPECT_EQ(std::count(finished.error_output.begin(), finished.error_output.end(), '\n'), 1) << finished.error_output;
    EXPECT_LT(finished.error_output.size(), 150U) << finished.error_output;
    const bool names_it = finished.error_output.find(arguments.front()) != std::string::npos ||
                          finished.error_output.find(arguments.back()) != std::string::npos;
    EXPECT_TRUE(names_it) << finished.error_output;
  }
}

TEST_F(ServerProgram, WhatIsWrongInAConfigurationFileIsSaidWithItsLine) {
  const auto refused = [](const std::string& text, const std::string& says) {
    const std::string config = temporary_file("wrong.toml", text);
    const auto finished = run_program("pneuma-server", {"--config", config});
    std::remove(config.c_str());
    EXPECT_EQ(finished.exit_status, 2) << text;
    EXPECT_EQ(finished.error_output, "pneuma-server: " + config + ": " + says + "\n");
  };
  refused("# limits\nworlds-mx = 3\n", "line 2: no flag is named worlds-mx; pneuma-server --help lists them");
  refused("listen = \"127.0.0.1:0\n", "line 1: a quote is not closed");
  refused("scene = [\"hand\", 'five-balls]\n", "line 1: a quote is not closed");
  refused("[server]\nlisten = \"127.0.0.1:0\"\n", "line 1: there are no sections here");
}

TEST_F(ServerProgram, AListInAConfigurationFileMayGoOnOverLines) {
  const std::string config = temporary_file(
      "lines.toml", "# worlds\nscene = [\"bouncing-ball\",  # the first\n  'five-balls']\nworlds-max = 2\n");
  start({"--config", config});
  std::remove(config.c_str());
  EXPECT_EQ(connect().list_worlds()->worlds_size(), 2);
}

TEST_F(ServerProgram, ALimitThatIsNoNumberIsSaid) {
  for (const std::string amount : {"many", "nan", "0", "1e99"}) {
    const auto finished = run_program("pneuma-server", {"--worlds-max", amount});
    EXPECT_EQ(finished.exit_status, 2);
    EXPECT_EQ(finished.error_output,
              "pneuma-server: --worlds-max: '" + amount + "' is no number from 1 to 2147483647\n");
  }
}

// As the container's health check does it: the same file, and no other flag.
TEST_F(ServerProgram, HealthReadsTheServersConfiguration) {
  start({"--scene", "bouncing-ball"});
  const std::string config = temporary_file("health.toml", "http = \"" + server_->http_address() + "\"\n");
  const auto well = run_program("pneuma-server", {"--health", "--config", config});
  std::remove(config.c_str());
  EXPECT_EQ(well.exit_status, 0) << well.error_output;
}

TEST_F(ServerProgram, WhatCannotBeHadIsSaidInOneLine) {
  expect_failure({"--scene", "no-such-scene"}, "no-such-scene");
  const std::string open_mesh = temporary_file("typo.json", R"({"gravty": {"y": -9.81}})");
  expect_failure({"--scene", open_mesh}, open_mesh + ": gravty");
  std::remove(open_mesh.c_str());
  const std::string no_mesh = temporary_file("no-mesh.json", R"({"soft_bodies": [{"name": "b", "mesh": "m"}]})");
  expect_failure({"--scene", no_mesh}, no_mesh + ": soft_bodies[0].mesh: no mesh is named");
  std::remove(no_mesh.c_str());
  expect_failure({"--token-file", "/no/such/token"}, "/no/such/token");
  expect_failure({"--tls-cert", "/no/such/cert.pem", "--tls-key", "/no/such/key.pem"}, "/no/such");
  expect_failure({"--data-dir", "/dev/null/data"}, "/dev/null/data");
}

TEST_F(ServerProgram, APortInUseIsSaid) {
  start();
  expect_failure({"--listen", server_->tcp_address()}, server_->tcp_address());
}

TEST_F(ServerProgram, ADataDirectoryHasOneServer) {
  const support::TemporaryFolder folder;
  start({"--data-dir", folder.path()});
  expect_failure({"--data-dir", folder.path()}, folder.path());
}

TEST_F(ServerProgram, HealthAsksTheServer) {
  start({"--scene", "bouncing-ball"});
  const auto well = run_program("pneuma-server", {"--health", "--http", server_->http_address()});
  EXPECT_EQ(well.exit_status, 0) << well.error_output;
  const support::ClosedPort nobody;
  const auto gone = run_program("pneuma-server", {"--health", "--http", nobody.address()});
  EXPECT_EQ(gone.exit_status, 1);
  EXPECT_EQ(gone.error_output, "pneuma-server: " + nobody.address() + ": cannot connect: Connection refused\n");
  const auto other_port = run_program("pneuma-server", {"--health", "--http", server_->tcp_address()});
  EXPECT_EQ(other_port.exit_status, 1);
  EXPECT_NE(other_port.error_output.find("no HTTP answer"), std::string::npos) << other_port.error_output;
  const auto off = run_program("pneuma-server", {"--health", "--http", "off"});
  EXPECT_EQ(off.exit_status, 1);
  EXPECT_NE(off.error_output.find("--http is off"), std::string::npos) << off.error_output;
}

TEST_F(ServerProgram, AConfigurationFileSetsFlagsAndLimits) {
  const std::string config =
      temporary_file("config.toml", "scene = [\"bouncing-ball\", \"five-balls\"]\nworlds-max = 3\n");
  start({"--config", config});
  std::remove(config.c_str());
  client::Client client = connect();
  EXPECT_EQ(client.list_worlds()->worlds_size(), 2);
  EXPECT_TRUE(client.create_builtin("hanging-ball").ok());
  EXPECT_EQ(client.create_builtin("hanging-ball").status().code(), base::StatusCode::limit_exceeded);
}

TEST_F(ServerProgram, EveryBuiltInSceneServes) {
  start({"--scene", "five-balls", "--scene", "hanging-ball", "--scene", "wind-cloth", "--scene", "bouncing-ball",
         "--scene", "hand", "--scene", "cost-curve"});
  client::Client client = connect();
  const auto list = client.list_worlds();
  ASSERT_TRUE(list.ok());
  EXPECT_EQ(list->worlds_size(), 6);
  for (const auto& world : list->worlds()) {
    SCOPED_TRACE(world.name());
    ASSERT_TRUE(client.subscribe(world.name()).ok());
    const auto frame = await_frame(client, [&](const auto& candidate) { return candidate.world == world.name(); });
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->bodies.size(), world.soft_bodies());
  }
}

}  // namespace
}  // namespace pneuma::integration
