// Shows what the `pneuma` command says, and exits with, when it is used wrongly or a server refuses.
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include <google/protobuf/struct.pb.h>
#include <gtest/gtest.h>

#include "support/closed_port.h"
#include "support/program.h"
#include "support/temporary_folder.h"
#include "unit/client/command_runner.h"
#include "unit/client/fake_server.h"

namespace pneuma::client {
namespace {

using support::Finished;
using support::run_program;

TEST(CommandUsage, BadArgumentsExitWith2AndOneLineSaysWhy) {
  const std::vector<std::vector<std::string>> bad = {
      {},
      {"nonsense"},
      {"--server", "nowhere", "worlds"},
      {"create"},
      {"step"},
      {"step", "w", "0"},
      {"step", "w", "-5"},
      {"watch", "w", "--frames", "0"},
      {"watch", "w", "--rate", "nan"},
      {"impulse", "w", "ball"},
      {"impulse", "w", "--impulse", "1,2,3"},
      {"impulse", "w", "ball", "--impulse", "1,2"},
      {"impulse", "w", "ball", "--impulse", "1,2,x"},
      {"impulse", "w", "ball", "--impulse", "1,2,inf"},
      {"impulse", "w", "ball", "--impulse", "1,2,3", "--radius", "1"},
      {"impulse", "w", "ball", "--impulse", "1,2,3", "--at", "0,0,0", "--radius", "-1"},
      {"impulse", "w", "ball", "--impulse", "1,2,3", "--at", "0,0,0", "--radius", "nan"},
      {"worlds", "worlds"},
      {"snapshot", "w"},
      {"branch"},
      {"branch", "w", "--at", "-1"},
      {"rewind", "w"},
      {"verify"},
      {"impulse", "w", "ball", "--impulse", "1,2,3", "--vertex", "1", "--at", "0,0,0"},
      {"--ca", "file", "worlds"},
  };
  for (const auto& arguments : bad) {
    const Finished finished = run_program("pneuma", arguments);
    EXPECT_EQ(finished.exit_status, 2) << testing::PrintToString(arguments);
    ASSERT_EQ(lines(finished.error_output).size(), 1U) << finished.error_output;
    EXPECT_TRUE(finished.error_output.starts_with("pneuma: ")) << finished.error_output;
    EXPECT_LT(finished.error_output.size(), 150U) << finished.error_output;
    EXPECT_EQ(finished.output, "");
  }
}

TEST(CommandUsage, WithJsonBadArgumentsAreAnErrorObject) {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"--json"}, {"step", "w", "0", "--json"}, {"--json", "nonsense"}}) {
    const Finished finished = run_program("pneuma", arguments);
    EXPECT_EQ(finished.exit_status, 2) << testing::PrintToString(arguments);
    const auto error = json(finished.error_output).fields().at("error").struct_value().fields();
    EXPECT_EQ(error.at("code").string_value(), "INVALID_ARGUMENT");
    EXPECT_NE(error.at("what").string_value(), "");
  }
}

TEST(CommandUsage, HelpAndVersionExitWith0) {
  EXPECT_EQ(run_program("pneuma", {"--help"}).exit_status, 0);
  EXPECT_EQ(run_program("pneuma", {"impulse", "--help"}).exit_status, 0);
  const Finished version = run_program("pneuma", {"--version"});
  EXPECT_EQ(version.exit_status, 0);
  EXPECT_TRUE(version.output.starts_with("pneuma "));
}

TEST(CommandFailure, NoServerIsOneLineWithTheAddress) {
  const support::ClosedPort nobody;
  const Finished finished = run_program("pneuma", {"--server", nobody.address(), "worlds"});
  EXPECT_EQ(finished.exit_status, 1);
  EXPECT_EQ(finished.error_output,
            "pneuma: " + nobody.address() + ": cannot connect: Connection refused; is a server running there?\n");
}

TEST(CommandFailure, TheServerOfTheEnvironmentIsAskedWhereNoFlagNamesOne) {
  const support::ClosedPort nobody;
  const support::ClosedPort nobody_either;
  ::setenv("PNEUMA_SERVER", nobody.address().c_str(), 1);
  const Finished told = run_program("pneuma", {"worlds"});
  const Finished flag = run_program("pneuma", {"--server", nobody_either.address(), "worlds"});
  ::setenv("PNEUMA_SERVER", "nowhere", 1);
  const Finished wrong = run_program("pneuma", {"worlds"});
  EXPECT_EQ(run_program("pneuma", {"--help"}).exit_status, 0) << "that is not asked of a server";
  ::unsetenv("PNEUMA_SERVER");
  EXPECT_EQ(told.error_output,
            "pneuma: " + nobody.address() + ": cannot connect: Connection refused; is a server running there?\n");
  EXPECT_EQ(flag.error_output, "pneuma: " + nobody_either.address() +
                                   ": cannot connect: Connection refused; is a server running there?\n");
  EXPECT_EQ(wrong.exit_status, 2);
  EXPECT_NE(wrong.error_output.find("not HOST:PORT: nowhere"), std::string::npos) << wrong.error_output;
}

void say_there_is_no_world(FakeSession& session) {
  session.welcome();
  session.reply([](const auto&, auto& message) {
    message.mutable_error()->set_code(v1::Error::NOT_FOUND);
    message.mutable_error()->set_what("no world \"nowhere\"");
    message.mutable_error()->set_where("pause.world");
  });
}

TEST(CommandFailure, ErrorReplyIsOneLineWithWhatAndWhere) {
  const FakeServer server(say_there_is_no_world);
  const Finished finished = run(server, {"pause", "nowhere"});
  EXPECT_EQ(finished.exit_status, 1);
  EXPECT_EQ(finished.output, "");
  EXPECT_EQ(finished.error_output, "pneuma: no world \"nowhere\" (pause.world)\n");
}

TEST(CommandUsage, AWordThatIsNotKnownIsToldWithTheNearestThatIs) {
  const auto told = [](const std::vector<std::string>& arguments) {
    const Finished finished = run_program("pneuma", arguments);
    EXPECT_EQ(finished.exit_status, 2);
    return finished.error_output;
  };
  EXPECT_EQ(told({"wach", "w"}), "pneuma: no command wach; did you mean watch?\n");
  EXPECT_EQ(told({"nonsense"}), "pneuma: no command nonsense; pneuma --help lists them\n");
  EXPECT_EQ(told({"watch", "w", "--raet", "5"}), "pneuma: no flag --raet; did you mean --rate?\n");
  EXPECT_EQ(told({"worlds", "--jsn"}), "pneuma: no flag --jsn; did you mean --json?\n");
  EXPECT_EQ(told({"watch", "w", "--nonsense"}), "pneuma: no flag --nonsense; pneuma watch --help lists them\n");
}

/// What is told of a world that is not among these.
std::string told_of_world(const std::string& asked, const std::vector<std::string>& worlds) {
  const FakeServer server([&](FakeSession& session) {
    session.welcome();
    session.reply([](const auto&, auto& message) {
      message.mutable_error()->set_code(v1::Error::NOT_FOUND);
      message.mutable_error()->set_what("no such world");
      message.mutable_error()->set_where("pause.world");
    });
    session.reply([&](const auto&, auto& message) {
      message.mutable_world_list();
      for (const std::string& world : worlds) message.mutable_world_list()->add_worlds()->set_name(world);
    });
  });
  return run(server, {"pause", asked}).error_output;
}

TEST(CommandFailure, AWorldThatIsNotThereIsToldWithTheNearestOrAllThatAre) {
  EXPECT_EQ(told_of_world("five-bals", {"five-balls", "hand"}),
            "pneuma: no such world; did you mean five-balls? (pause.world)\n");
  EXPECT_EQ(told_of_world("x", {"five-balls", "hand"}),
            "pneuma: no such world; there are five-balls, hand (pause.world)\n");
  EXPECT_EQ(told_of_world("x", {}), "pneuma: no such world; there are none (pause.world)\n");
  const std::string many = told_of_world("x", std::vector<std::string>(100, "another-world"));
  EXPECT_LT(many.size(), 300U) << many;
}

/// What is said where the server refuses.
std::string told(const std::string& what, const std::string& where,
                 const std::vector<std::string>& arguments = {"pause", "w"}) {
  const FakeServer server([&](FakeSession& session) {
    session.welcome();
    session.reply([&](const auto&, auto& message) {
      message.mutable_error()->set_code(v1::Error::INVALID_ARGUMENT);
      message.mutable_error()->set_what(what);
      message.mutable_error()->set_where(where);
    });
  });
  return run(server, arguments, "{").error_output;
}

TEST(CommandFailure, WhatIsWrongInAFileIsToldByItsPlaceThere) {
  const support::TemporaryFolder folder;
  const std::string file = folder / "bad.json";
  std::ofstream(file) << "{";
  EXPECT_EQ(told("no valid JSON", "edit.edit_json.line 1, column 2", {"edit", "w", file}),
            "pneuma: " + file + ":1:2: no valid JSON\n");
  EXPECT_EQ(told("no valid JSON", "create_world.scene_json.line 1, column 2", {"create", "-"}),
            "pneuma: standard input:1:2: no valid JSON\n");
  EXPECT_EQ(told("is -1", "create_world.scene_json.soft_bodies[0].mass_kg", {"create", file}),
            "pneuma: " + file + ": soft_bodies[0].mass_kg: is -1\n");
  EXPECT_EQ(told("there is a world w", "create_world.name", {"create", file}),
            "pneuma: there is a world w (create_world.name)\n");
  EXPECT_NE(told("no valid JSON", "edit.edit_json.line 1, column 2", {"--json", "edit", "w", file})
                .find(R"("where":"edit.edit_json.line 1, column 2")"),
            std::string::npos);
}

TEST(CommandFailure, WordsComeFirstAndWhatTheyAreSaidOfIsNamed) {
  EXPECT_EQ(told("is not finite", "impulse.impulse.x"), "pneuma: x is not finite (impulse.impulse.x)\n");
  EXPECT_EQ(told("the world runs; pause it first", "step.world"),
            "pneuma: the world runs; pause it first (step.world)\n");
  EXPECT_EQ(told("cannot write", "edit.json"), "pneuma: edit.json: cannot write\n") << "a file, not a path of the wire";
}

TEST(CommandFailure, WithJsonAnErrorIsAnObjectOnStandardError) {
  const FakeServer server(say_there_is_no_world);
  const Finished finished = run(server, {"--json", "pause", "nowhere"});
  EXPECT_EQ(finished.exit_status, 1);
  EXPECT_EQ(finished.output, "");
  EXPECT_EQ(finished.error_output,
            R"({"error":{"code":"NOT_FOUND","where":"pause.world","what":"no world \"nowhere\""}})"
            "\n");
}

}  // namespace
}  // namespace pneuma::client
