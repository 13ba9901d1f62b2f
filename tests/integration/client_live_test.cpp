// Shows what a person at a shell sees of `pneuma` beside a server: waiting, holding, the table of worlds, the browser,
// colour, and what came out otherwise than it was asked for.
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <sys/stat.h>

#include "served.h"
#include "support/temporary_folder.h"

namespace pneuma::integration {
namespace {

using support::Finished;
using support::Program;

class ClientLive : public Served {
 protected:
  [[nodiscard]] std::vector<std::string> with_server(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"--server", server_->tcp_address()});
    return arguments;
  }
  [[nodiscard]] Finished pneuma(const std::vector<std::string>& arguments) const {
    return support::run_program("pneuma", with_server(arguments));
  }
  [[nodiscard]] base::Result<Program> start_pneuma(const std::vector<std::string>& arguments) const {
    return Program::start(support::program_path("pneuma"), with_server(arguments));
  }
  /// On a terminal of 80 columns, by script(1), which is on every Debian.
  [[nodiscard]] base::Result<Program> on_terminal(const std::string& arguments) const {
    const std::string command =
        support::program_path("pneuma") + " --server " + server_->tcp_address() + " " + arguments;
    return Program::start("/usr/bin/script", {"-qec", command, "/dev/null"});
  }
  static void await_subscriber(client::Client& client) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < deadline) {
      const auto list = client.list_worlds();
      ASSERT_TRUE(list.ok());
      if (list->worlds(0).subscribers() > 0) return;
    }
    FAIL() << "nobody subscribes";
  }
};

TEST_F(ClientLive, WaitEndsAtItsTick) {
  start();
  client::Client client = connect();
  create(client, two_balls(), "w", true);
  ASSERT_TRUE(client.step("w", 40).ok());
  EXPECT_EQ(pneuma({"wait", "w", "--until", "30"}).output, "w at tick 40\n") << "it has been there already";
  EXPECT_EQ(pneuma({"--json", "wait", "w", "--until", "30"}).output, "{\"world\":\"w\",\"tick\":40}\n");
  auto waiting = start_pneuma({"wait", "w", "--until", "60"});
  ASSERT_TRUE(waiting.ok());
  await_subscriber(client);
  EXPECT_TRUE(waiting->is_running());
  ASSERT_TRUE(client.step("w", 20).ok());
  const auto line = waiting->next_line(patience);
  ASSERT_TRUE(line.ok()) << line.status().message();
  EXPECT_EQ(*line, "w at tick 60");
  EXPECT_EQ(*waiting->wait(patience), 0);
}

TEST_F(ClientLive, WaitEndsAtItsEventAndFailsWithTheWorldOrInTime) {
  start();
  client::Client client = connect();
  create(client, two_balls(), "w", true);
  auto waiting = start_pneuma({"wait", "w", "--until", "world-reset"});
  ASSERT_TRUE(waiting.ok());
  await_subscriber(client);
  ASSERT_TRUE(client.reset("w").ok());
  const auto line = waiting->next_line(patience);
  ASSERT_TRUE(line.ok()) << line.status().message();
  EXPECT_TRUE(line->starts_with("WORLD_RESET w at tick ")) << *line;
  EXPECT_EQ(*waiting->wait(patience), 0);

  const Finished late = pneuma({"wait", "w", "--until", "100000", "--timeout", "2"});
  EXPECT_EQ(late.exit_status, 1);
  EXPECT_EQ(late.error_output, "pneuma: w: not within 2 s (--until 100000); it is at tick 0\n");
  const Finished wrong = pneuma({"wait", "w", "--until", "sunset"});
  EXPECT_EQ(wrong.exit_status, 2);
  EXPECT_NE(wrong.error_output.find("BODY_BURST"), std::string::npos) << wrong.error_output;

  auto bereft = start_pneuma({"wait", "w", "--until", "BODY_BURST"});
  ASSERT_TRUE(bereft.ok());
  await_subscriber(client);
  ASSERT_TRUE(client.destroy_world("w").ok());
  EXPECT_EQ(*bereft->wait(patience), 1);
  EXPECT_EQ(bereft->error_output(), "pneuma: w: the world was destroyed\n");
}

// Two equal balls at one height: the one that is held and lifted stays above the one that falls.
TEST_F(ClientLive, GrabLiftsABallAndLetsGo) {
  start();
  client::Client client = connect();
  create(client, two_balls(), "w");
  const Finished lifted =
      pneuma({"grab", "w", "left", "--at", "-2,4,0", "--to", "-2,5,0", "--to", "-2,6,0", "--stiffness", "300"});
  EXPECT_EQ(lifted.exit_status, 0) << lifted.error_output;
  EXPECT_TRUE(lifted.output.starts_with("holding w at tick ")) << lifted.output;
  EXPECT_NE(lifted.output.find("\nlet go of w at tick "), std::string::npos) << lifted.output;
  const auto stats = client.stats("w");
  ASSERT_TRUE(stats.ok());
  EXPECT_GT(stats->soft_bodies(0).centre_of_mass().y(), stats->soft_bodies(1).centre_of_mass().y() + 1.0);
}

TEST_F(ClientLive, GrabOfAVertexBeginsWhereItIsAndEndsByCtrlC) {
  start();
  client::Client client = connect();
  create(client, two_balls(), "w", true);
  const auto subscribed = client.subscribe("w", {.commands = true, .bodies = {"right"}});
  ASSERT_TRUE(subscribed.ok());
  const auto frame = await_frame(client);
  ASSERT_TRUE(frame);
  auto held = start_pneuma({"--json", "grab", "w", "right", "--vertex", "7", "--to", "9,9,9", "--hold", "600"});
  ASSERT_TRUE(held.ok());
  const auto line = held->next_line(patience);
  ASSERT_TRUE(line.ok()) << line.status().message() << line.status().where();
  EXPECT_NE(line->find("\"vertex\":7"), std::string::npos) << *line;
  held->send_signal(SIGINT);
  EXPECT_EQ(*held->wait(patience), 0) << held->error_output();
  EXPECT_NE(held->output().find("\"world\":\"w\""), std::string::npos) << held->output();
  std::optional<v1::Vec3> first_target;
  while (!first_target) {
    const auto update = client.next_update(patience);
    ASSERT_TRUE(update.ok() && *update);
    const auto* applied = std::get_if<v1::Applied>(&**update);
    if (applied != nullptr && applied->command().has_grab()) first_target = applied->command().grab().target();
  }
  EXPECT_NEAR(first_target->x(), frame->bodies[0].positions_m[21], 2e-3);
  EXPECT_NEAR(first_target->y(), frame->bodies[0].positions_m[22], 2e-3);

  EXPECT_EQ(pneuma({"grab", "w", "right", "--vertex", "9999", "--to", "0,0,0"}).exit_status, 1);
  EXPECT_EQ(pneuma({"grab", "w", "right", "--to", "0,0,0"}).exit_status, 2);
}

TEST_F(ClientLive, TopIsOneTableWhereNobodyWatchesAndRedrawnOnATerminal) {
  ::setenv("TERM", "xterm", 1);
  start();
  client::Client client = connect();
  create(client, two_balls(), "first");
  create(client, two_balls(), "second", true);
  const Finished table = pneuma({"top"});
  EXPECT_EQ(table.exit_status, 0) << table.error_output;
  EXPECT_TRUE(table.output.starts_with("world   state    ")) << table.output;
  EXPECT_NE(table.output.find("\nfirst   running"), std::string::npos) << table.output;
  EXPECT_NE(table.output.find("\nsecond  paused"), std::string::npos) << table.output;
  EXPECT_EQ(table.output.find('\033'), std::string::npos) << table.output;
  const Finished objects = pneuma({"--json", "top"});
  for (const char* key :
       {"\"step_ms\":", "\"late_ms_p99\":", "\"clients\":", "\"frame_bytes_s\":", "\"memory_bytes\":"}) {
    EXPECT_NE(objects.output.find(key), std::string::npos) << key << " in " << objects.output;
  }

  auto live = on_terminal("top");
  ASSERT_TRUE(live.ok());
  std::string drawn;
  while (drawn.find("\033[3A") == std::string::npos) {  // back to the first of three lines
    const auto line = live->next_line(patience);
    ASSERT_TRUE(line.ok()) << line.status().message();
    drawn += *line;
  }
  EXPECT_NE(drawn.find("first"), std::string::npos) << drawn;
  auto once = on_terminal("top --once");
  ASSERT_TRUE(once.ok());
  EXPECT_EQ(*once->wait(patience), 0);
}

TEST_F(ClientLive, OpenShowsThePageOfAWorldAndPrintsItsAddress) {
  const support::TemporaryFolder folder;
  const std::string browser = folder / "browser";
  const std::string shown = folder / "shown";
  std::ofstream(browser) << "#!/bin/sh\necho \"$1\" >" << shown << "\n";
  ASSERT_EQ(::chmod(browser.c_str(), 0700), 0);
  start();
  client::Client client = connect();
  create(client, two_balls(), "lab-1");
  const std::string link = "http://" + server_->http_address() + "/#world=lab-1";

  ::setenv("BROWSER", browser.c_str(), 1);
  const Finished opened = pneuma({"open", "lab-1", "--http", server_->http_address()});
  EXPECT_EQ(opened.exit_status, 0) << opened.error_output;
  EXPECT_EQ(opened.output, link + "\n");
  EXPECT_EQ(opened.error_output, "");
  std::string line;
  std::ifstream read_shown(shown);
  std::getline(read_shown, line);
  EXPECT_EQ(line, link);
  for (const std::string& browsers :
       {"no-such-browser:" + browser, browser + " %s", "no-such-browser %s:" + browser + " %s"}) {
    std::filesystem::remove(shown);
    ::setenv("BROWSER", browsers.c_str(), 1);
    EXPECT_EQ(pneuma({"open", "lab-1", "--http", server_->http_address()}).error_output, "") << browsers;
    std::ifstream again(shown);
    std::getline(again, line);
    EXPECT_EQ(line, link) << browsers;
  }
  const Finished unknown = pneuma({"open", "lab-2"});
  EXPECT_EQ(unknown.exit_status, 1);
  EXPECT_NE(unknown.error_output.find("did you mean lab-1?"), std::string::npos) << unknown.error_output;

  ::setenv("BROWSER", "/bin/false", 1);
  const Finished closed = pneuma({"open"});
  ::unsetenv("BROWSER");
  EXPECT_EQ(closed.exit_status, 0);
  EXPECT_NE(closed.error_output.find("no browser could be started"), std::string::npos) << closed.error_output;
  const std::string& address = server_->tcp_address();
  const int port = std::stoi(address.substr(address.rfind(':') + 1));
  EXPECT_EQ(closed.output, "http://127.0.0.1:" + std::to_string(port + 1) + "\n");
}

TEST_F(ClientLive, ColourIsForTerminalsWhoseUserDoesNotRefuseIt) {
  ::setenv("TERM", "xterm", 1);
  ::unsetenv("NO_COLOR");
  start();
  const auto shown = [&](const std::string& arguments) {
    auto program = on_terminal(arguments);
    EXPECT_TRUE(program.ok());
    EXPECT_TRUE(program->wait(patience).ok());
    return program->output();
  };
  EXPECT_NE(shown("pause nowhere").find("\033[31mpneuma: \033[0mno world nowhere"), std::string::npos);
  EXPECT_NE(shown("worlds").find("\033[1mworld  scene"), std::string::npos);
  EXPECT_EQ(pneuma({"worlds"}).output.find('\033'), std::string::npos);
  EXPECT_EQ(pneuma({"pause", "nowhere"}).error_output.find('\033'), std::string::npos);
  ::setenv("NO_COLOR", "1", 1);
  EXPECT_EQ(shown("pause nowhere").find('\033'), std::string::npos);
  EXPECT_EQ(shown("worlds").find('\033'), std::string::npos);
  ::unsetenv("NO_COLOR");
}

TEST_F(ClientLive, WhatCameOutOtherwiseIsSaidOnStandardError) {
  start({"--scene", "bouncing-ball"});
  const Finished rounded = pneuma({"watch", "bouncing-ball", "--rate", "1000", "--frames", "1"});
  EXPECT_EQ(rounded.exit_status, 0);
  EXPECT_TRUE(rounded.error_output.starts_with("pneuma: 60 frames a second, not 1000: ")) << rounded.error_output;
  EXPECT_EQ(pneuma({"watch", "bouncing-ball", "--rate", "30", "--frames", "1"}).error_output, "");
  EXPECT_EQ(pneuma({"watch", "bouncing-ball", "--max-error", "0.0007", "--frames", "1"}).error_output, "");

  const Finished for_scripts = pneuma({"--json", "watch", "bouncing-ball", "--rate", "1000", "--frames", "1"});
  EXPECT_TRUE(for_scripts.error_output.starts_with(R"({"note":"60 frames a second, not 1000: )"))
      << for_scripts.error_output;

  const Finished renamed = pneuma({"create", "bouncing-ball"});
  EXPECT_EQ(renamed.error_output, "pneuma: the new world is bouncing-ball-2: there is a world bouncing-ball already\n");
  EXPECT_EQ(pneuma({"create", "five-balls"}).error_output, "");
  EXPECT_EQ(pneuma({"create", "five-balls", "--name", "hall-2"}).error_output, "");
}

}  // namespace
}  // namespace pneuma::integration
