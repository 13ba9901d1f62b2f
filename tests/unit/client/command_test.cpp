// Shows the `pneuma` command as a shell sees it, against a server that follows a script: arguments to requests, replies
// to lines, exit codes.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>

#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include "support/program.h"
#include "support/temporary_folder.h"
#include "unit/client/command_runner.h"
#include "unit/client/fake_server.h"

namespace pneuma::client {
namespace {

using support::Finished;
using support::run_program;

/// The request that a command sends; it is answered with Done.
v1::ClientMessage request_of(const std::vector<std::string>& arguments, const std::string& input = {}) {
  v1::ClientMessage sent;
  {
    const FakeServer server([&](FakeSession& session) {
      session.welcome();
      session.reply([&](const auto& request, auto& message) {
        sent = request;
        message.mutable_done()->set_world("w");
        message.mutable_done()->set_tick(5);
      });
    });
    const Finished finished = run(server, arguments, input);
    EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
  }
  return sent;
}

TEST(CommandWorldFiles, BranchRestoreAndRewindAskForWhatTheyAreTold) {
  const v1::BranchWorld branch = request_of({"branch", "w", "--at", "15", "--name", "n", "--paused"}).branch_world();
  EXPECT_EQ(branch.world(), "w");
  EXPECT_EQ(branch.tick(), 15U);
  EXPECT_EQ(branch.name(), "n");
  EXPECT_TRUE(branch.paused());
  EXPECT_FALSE(request_of({"branch", "w"}).branch_world().has_tick());
  EXPECT_EQ(request_of({"rewind", "w", "7"}).rewind_world().tick(), 7U);
  const support::TemporaryFolder folder;
  std::ofstream(folder / "f.world") << "what is in it";
  const v1::RestoreWorld restore = request_of({"restore", folder / "f.world", "--name", "n"}).restore_world();
  EXPECT_EQ(restore.snapshot(), "what is in it");
  EXPECT_EQ(restore.name(), "n");
  EXPECT_FALSE(restore.paused());
}

TEST(CommandWorldFiles, ASnapshotIsFetchedInPiecesAndReplacesAFileWithForceAlone) {
  const support::TemporaryFolder folder;
  const std::string file = folder / "w.world";
  const auto piece = [](std::uint64_t offset, const std::string& data) {
    return [=](const v1::ClientMessage& request, v1::ServerMessage& message) {
      if (offset > 0) {
        EXPECT_EQ(request.read_snapshot().offset(), offset);
      }
      message.mutable_snapshot()->set_snapshot_id(3);
      message.mutable_snapshot()->set_offset(offset);
      message.mutable_snapshot()->set_data(data);
      message.mutable_snapshot()->set_bytes_total(10);
      message.mutable_snapshot()->set_tick(40);
    };
  };
  const auto snapshot_into = [&](std::vector<std::string> arguments) {
    const FakeServer server([&](FakeSession& session) {
      session.welcome();
      if (session.reply(piece(0, "abcd")) && session.reply(piece(4, "efgh"))) session.reply(piece(8, "ij"));
    });
    arguments.insert(arguments.begin(), {"snapshot", "w"});
    return run(server, arguments);
  };
  const Finished first = snapshot_into({file});
  EXPECT_EQ(first.exit_status, 0) << first.error_output;
  EXPECT_EQ(first.output, file + ": w at tick 40, 10 bytes, no history\n");
  std::ifstream in(file);
  std::string text;
  in >> text;
  EXPECT_EQ(text, "abcdefghij");
  const Finished again = snapshot_into({file});
  EXPECT_EQ(again.exit_status, 1);
  EXPECT_NE(again.error_output.find("--force"), std::string::npos) << again.error_output;
  EXPECT_EQ(snapshot_into({file, "--force"}).exit_status, 0);
}

TEST(CommandRequests, VectorsMayBeginWithAMinus) {
  auto impulse =
      request_of({"impulse", "w", "ball", "--at", "-1,2,-3", "--radius", "0.5", "--impulse", "-.5,0,1e1"}).impulse();
  EXPECT_EQ(impulse.world(), "w");
  EXPECT_EQ(impulse.body(), "ball");
  EXPECT_EQ(impulse.near().position().x(), -1.0);
  EXPECT_EQ(impulse.near().position().z(), -3.0);
  EXPECT_EQ(impulse.near().radius_m(), 0.5);
  EXPECT_EQ(impulse.impulse().x(), -0.5);
  EXPECT_EQ(impulse.impulse().z(), 10.0);
}

TEST(CommandRequests, ImpulseNamesItsPoint) {
  auto impulse = request_of({"impulse", "w", "ball", "--vertex", "0", "--impulse", "0,1,0"}).impulse();
  EXPECT_EQ(impulse.at_case(), v1::Impulse::kVertex);
  impulse = request_of({"impulse", "w", "--ray", "-5,0,0,1,0,0", "--impulse", "0,1,0"}).impulse();
  EXPECT_EQ(impulse.body(), "");
  EXPECT_EQ(impulse.ray().origin().x(), -5.0);
  EXPECT_EQ(impulse.ray().direction().x(), 1.0);
  impulse = request_of({"impulse", "w", "ball", "--impulse", "0,1,0"}).impulse();
  EXPECT_EQ(impulse.at_case(), v1::Impulse::AT_NOT_SET);
}

TEST(CommandRequests, WorldsAreMadeOfNamesFilesAndStandardInput) {
  auto create = request_of({"create", "five-balls", "--name", "mine", "--paused"}).create_world();
  EXPECT_EQ(create.builtin(), "five-balls");
  EXPECT_EQ(create.name(), "mine");
  EXPECT_TRUE(create.paused());

  const auto file = std::filesystem::temp_directory_path() / ("scene-" + std::to_string(getpid()) + ".json");
  std::ofstream(file) << "{\"name\":\"s\"}";
  create = request_of({"create", file.string()}).create_world();
  std::filesystem::remove(file);
  EXPECT_EQ(create.scene_json(), "{\"name\":\"s\"}");
  EXPECT_FALSE(create.paused());

  EXPECT_EQ(request_of({"create", "-"}, "{}").create_world().scene_json(), "{}");
  EXPECT_EQ(request_of({"create", "-"}, "\xEF\xBB\xBF{}").create_world().scene_json(), "{}") << "a byte order mark";
  EXPECT_EQ(request_of({"edit", "w", "-"}, "{\"changes\":[]}").edit().edit_json(), "{\"changes\":[]}");
}

TEST(CommandRequests, FileThatIsNotThereIsNamed) {
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    session.drain();
  });
  const Finished finished = run(server, {"create", "./no-such.json"});
  EXPECT_EQ(finished.exit_status, 1);
  EXPECT_EQ(finished.error_output, "pneuma: ./no-such.json: No such file or directory\n");
}

TEST(CommandRequests, NothingToReadIsSaid) {
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    session.drain();
  });
  const Finished finished = run(server, {"create", "-"}, "");
  EXPECT_EQ(finished.exit_status, 1);
  EXPECT_EQ(finished.error_output, "pneuma: standard input: is empty\n");
}

TEST(CommandRequests, TextThatIsNotUtf8IsNamedByItsLine) {
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    session.drain();
  });
  const Finished finished = run(server, {"edit", "w", "-"}, "{\n\"name\": \"\xFF\"}");
  EXPECT_EQ(finished.exit_status, 1);
  EXPECT_EQ(finished.error_output, "pneuma: standard input:2:10: is not UTF-8\n");
}

/// The token that a command's hello holds.
std::string token_of(std::vector<std::string> arguments) {
  v1::Hello hello;
  {
    const FakeServer server([&](FakeSession& session) {
      hello = session.welcome();
      session.reply([](const auto&, auto& message) { message.mutable_world_list(); });
    });
    arguments.emplace_back("worlds");
    const Finished finished = run(server, arguments);
    EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
  }
  return hello.token();
}

TEST(CommandToken, ComesFromAFlagAFileOrTheEnvironment) {
  const support::TemporaryFolder folder;
  const std::string file = folder / "token";
  std::ofstream(file) << "of the file\r\nno token\n";
  ::unsetenv("PNEUMA_TOKEN");
  EXPECT_EQ(token_of({}), "");
  EXPECT_EQ(token_of({"--token", "of the flag"}), "of the flag");
  EXPECT_EQ(token_of({"--token-file", file}), "of the file");
  ::setenv("PNEUMA_TOKEN", "of the environment", 1);
  EXPECT_EQ(token_of({}), "of the environment");
  EXPECT_EQ(token_of({"--token", "of the flag"}), "of the flag");
  EXPECT_EQ(token_of({"--token-file", file}), "of the file");
  ::unsetenv("PNEUMA_TOKEN");
}

TEST(CommandToken, FileWithoutATokenIsNamed) {
  const support::TemporaryFolder folder;
  std::ofstream(folder / "blank") << "\ntoken\n";
  for (const char* name : {"blank", "none"}) {
    const Finished finished = run_program("pneuma", {"--token-file", folder / name, "worlds"});
    EXPECT_EQ(finished.exit_status, 1);
    EXPECT_NE(finished.error_output.find(folder / name), std::string::npos) << finished.error_output;
  }
  EXPECT_EQ(run_program("pneuma", {"--token-file", folder / "blank", "--token", "t", "worlds"}).exit_status, 2);
}

TEST(CommandToken, ServerThatAsksForOneSaysHowToGiveIt) {
  ::unsetenv("PNEUMA_TOKEN");
  const FakeServer server([](FakeSession& session) {
    session.reply([](const auto&, auto& message) {
      message.mutable_error()->set_code(v1::Error::UNAUTHENTICATED);
      message.mutable_error()->set_what("is missing");
      message.mutable_error()->set_where("hello.token");
    });
  });
  const Finished finished = run(server, {"worlds"});
  EXPECT_EQ(finished.exit_status, 1);
  EXPECT_EQ(finished.error_output,
            "pneuma: token is missing; give it by --token-file, --token or PNEUMA_TOKEN (hello.token)\n");
}

TEST(CommandRequests, EachCommandAsksWhatItSays) {
  EXPECT_EQ(request_of({"destroy", "w"}).destroy_world().world(), "w");
  EXPECT_EQ(request_of({"pause", "w"}).pause().world(), "w");
  EXPECT_EQ(request_of({"resume", "w"}).resume().world(), "w");
  EXPECT_FALSE(request_of({"resume", "w"}).resume().has_time_scale());
  EXPECT_EQ(request_of({"resume", "w", "--time-scale", "0.25"}).resume().time_scale(), 0.25);
  EXPECT_EQ(request_of({"reset", "w"}).reset().world(), "w");
  EXPECT_EQ(request_of({"step", "w", "30"}).step().ticks(), 30U);
  EXPECT_EQ(request_of({"step", "w"}).step().ticks(), 1U);
}

TEST(CommandOutput, WorldsAreATableOrALineOfJsonEach) {
  const auto script = [](FakeSession& session) {
    session.welcome();
    session.reply([](const auto&, auto& message) {
      for (const char* name : {"w", "longer-name"}) {
        auto* world = message.mutable_world_list()->add_worlds();
        world->set_name(name);
        world->set_vertices(162);
      }
    });
  };
  const FakeServer first(script);
  const auto table = lines(run(first, {"worlds"}).output);
  ASSERT_EQ(table.size(), 3U);
  EXPECT_TRUE(table[0].starts_with("world        scene")) << table[0];
  EXPECT_TRUE(table[1].starts_with("w            ")) << table[1];

  const FakeServer second(script);
  const auto objects = lines(run(second, {"worlds", "--json"}).output);
  ASSERT_EQ(objects.size(), 2U);
  const auto world = json(objects[1]);
  EXPECT_EQ(world.fields().at("name").string_value(), "longer-name");
  EXPECT_EQ(world.fields().at("vertices").number_value(), 162.0);
  EXPECT_EQ(world.fields().at("paused").bool_value(), false);  // shown also where it is not set
}

TEST(CommandOutput, SceneIsAFileThatCreateTakesWithJsonInOneLine) {
  for (const bool one_line : {false, true}) {
    const FakeServer server([](FakeSession& session) {
      session.welcome();
      session.reply([](const auto&, auto& message) {
        message.mutable_scene()->mutable_scene()->set_name("s");
        message.mutable_scene()->mutable_scene()->add_soft_bodies()->set_mass_kg(2.5);
      });
    });
    const std::string text = run(server, one_line ? std::vector<std::string>{"--json", "scene", "w"}
                                                  : std::vector<std::string>{"scene", "w"})
                                 .output;
    EXPECT_EQ(lines(text).size() == 1, one_line) << text;
    v1::Scene scene;
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(text, &scene).ok()) << text;
    EXPECT_EQ(scene.soft_bodies(0).mass_kg(), 2.5);
  }
}

TEST(CommandOutput, StatsTellWhoSleepsAndWhatEachStageTook) {
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    session.reply([](const auto&, auto& message) {
      v1::Stats& stats = *message.mutable_stats();
      stats.add_soft_bodies()->set_name("ball");
      stats.mutable_soft_bodies(0)->set_asleep(true);
      stats.add_soft_bodies()->set_name("cloth");
      stats.add_rigid_bodies()->set_name("stone");
      stats.mutable_rigid_bodies(0)->set_asleep(true);
      v1::Stats::Stage& stage = *stats.add_stages();
      stage.set_name("springs");
      stage.set_time_s(0.25);
      stage.set_calls(7);
      stage.set_bytes(4096);
    });
  });
  const auto table = lines(run(server, {"stats", "w"}).output);
  const auto row = [&](const std::string& name) {
    const auto found = std::ranges::find_if(table, [&](const auto& line) { return line.starts_with(name + " "); });
    return found == table.end() ? std::string() : *found;
  };
  EXPECT_TRUE(row("ball").ends_with("asleep")) << row("ball");
  EXPECT_TRUE(row("cloth").ends_with("live")) << row("cloth");
  EXPECT_TRUE(row("stone").ends_with("asleep")) << row("stone");
  for (const char* figure : {"0.25", "7", "4096"}) EXPECT_NE(row("springs").find(figure), std::string::npos);
}

TEST(CommandOutput, JsonNumbersAreNumbersAndAHashIsHexadecimal) {
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    session.reply([](const auto&, auto& message) {
      v1::Stats& stats = *message.mutable_stats();
      stats.set_world("a \"w\"");
      stats.set_tick(1'234'567'890'123);
      stats.set_state_hash(0xfedcba9876543210);
      stats.set_time_ratio(0.1);
      stats.set_step_time_ms(std::numeric_limits<double>::quiet_NaN());
      stats.add_stages()->set_calls(5'000'000'000);
      stats.add_soft_bodies()->mutable_centre_of_mass()->set_y(-2.5);
    });
  });
  const std::string text = run(server, {"--json", "stats", "w"}).output;
  ASSERT_EQ(lines(text).size(), 1U);
  const auto fields = json(text).fields();
  EXPECT_EQ(fields.at("world").string_value(), "a \"w\"");
  EXPECT_EQ(fields.at("tick").number_value(), 1'234'567'890'123.0);
  EXPECT_EQ(fields.at("state_hash").string_value(), "0xfedcba9876543210");
  EXPECT_EQ(fields.at("time_ratio").number_value(), 0.1);
  EXPECT_TRUE(fields.at("step_time_ms").has_null_value());
  EXPECT_FALSE(fields.at("paused").bool_value()) << "shown also where it is not set";
  EXPECT_TRUE(fields.at("paused").has_bool_value());
  EXPECT_EQ(fields.at("rigid_bodies").list_value().values_size(), 0);
  EXPECT_EQ(fields.at("stages").list_value().values(0).struct_value().fields().at("calls").number_value(), 5e9);
  const auto body = fields.at("soft_bodies").list_value().values(0).struct_value().fields();
  EXPECT_EQ(body.at("centre_of_mass").struct_value().fields().at("y").number_value(), -2.5);
  EXPECT_FALSE(body.contains("momentum"));
}

TEST(CommandOutput, TickIsANumberAlsoInWhatAChangeCameTo) {
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    session.reply([](const auto&, auto& message) {
      message.mutable_done()->set_world("w");
      message.mutable_done()->set_tick(5);
    });
  });
  EXPECT_EQ(run(server, {"--json", "pause", "w"}).output,
            "{\"tick\":5,\"world\":\"w\",\"detail\":\"\",\"mended\":[]}\n");
}

TEST(CommandOutput, MendedMeshesAreLinesOfTheirOwn) {
  const auto script = [](FakeSession& session) {
    session.welcome();
    session.reply([](const auto&, auto& message) {
      message.mutable_done()->set_world("w");
      v1::MendedMesh& mesh = *message.mutable_done()->add_mended();
      mesh.set_mesh("m");
      mesh.set_holes_closed(2);
      mesh.set_detail("2 holes closed with 7 faces");
    });
  };
  const FakeServer server(script);
  EXPECT_EQ(run(server, {"create", "hand"}).output,
            "created w at tick 0\nmesh \"m\" mended: 2 holes closed with 7 faces\n");
  const FakeServer again(script);
  const auto object = json(run(again, {"--json", "create", "hand"}).output);
  const auto& mended = object.fields().at("mended").list_value().values(0).struct_value().fields();
  EXPECT_EQ(mended.at("mesh").string_value(), "m");
  EXPECT_EQ(mended.at("holes_closed").number_value(), 2.0);
}

}  // namespace
}  // namespace pneuma::client
