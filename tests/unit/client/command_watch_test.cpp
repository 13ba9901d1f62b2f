// Shows `pneuma watch` as a shell sees it: a line or a file a frame, and its end by Ctrl-C, by a reader that goes away,
// or with the world.
#include <csignal>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "support/program.h"
#include "support/temporary_folder.h"
#include "unit/client/command_runner.h"
#include "unit/client/fake_server.h"

namespace pneuma::client {
namespace {

using support::Finished;
using support::Program;

/// Subscribes the command and sends two frames, a gap, a frame and an event.
void play(FakeSession& session) {
  session.welcome();
  session.reply([](const auto&, auto& message) { fill_subscribed(1, message); });
  session.send(topology_message());
  session.send(layout_message(1));
  session.send(key_frame(1, 1));
  session.send(delta_frame(1, 2, 1, 1000, 0));
  v1::ServerMessage gap;
  gap.mutable_gap()->set_stream_id(1);
  gap.mutable_gap()->set_from_tick(3);
  gap.mutable_gap()->set_to_tick(8);
  session.send(gap);
  session.send(key_frame(1, 9));
  v1::ServerMessage event;
  event.mutable_event()->set_kind(v1::Event::BODY_FROZEN);
  event.mutable_event()->set_world("w");
  event.mutable_event()->set_body("ball \"1\"");
  session.send(event);
}

TEST(CommandWatch, EveryUpdateIsALineOfJson) {
  const FakeServer server([](FakeSession& session) {
    play(session);
    session.send(key_frame(1, 10));
    session.drain();
  });
  const Finished finished = run(server, {"watch", "w", "--json", "--frames", "4"});
  EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
  const auto all = lines(finished.output);
  ASSERT_EQ(all.size(), 8U) << finished.output;
  const char* types[] = {"subscribed", "frame", "frame", "gap", "frame", "event", "frame", "summary"};
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(json(all[i]).fields().at("type").string_value(), types[i]);

  const auto delta = json(all[2]);
  EXPECT_EQ(delta.fields().at("tick").number_value(), 2.0);
  EXPECT_FALSE(delta.fields().at("key").bool_value());
  const auto& ball = delta.fields().at("bodies").list_value().values(0).struct_value();
  EXPECT_EQ(ball.fields().at("name").string_value(), "ball");
  EXPECT_EQ(ball.fields().at("vertices").number_value(), 4.0);
  EXPECT_DOUBLE_EQ(ball.fields().at("centre").list_value().values(0).number_value(), 1.25);
  EXPECT_DOUBLE_EQ(ball.fields().at("min").list_value().values(1).number_value(), 1.0);
  EXPECT_DOUBLE_EQ(ball.fields().at("max").list_value().values(2).number_value(), 2.0);
  EXPECT_EQ(json(all[5]).fields().at("body").string_value(), "ball \"1\"");
  const auto summary = json(all[7]);
  EXPECT_EQ(summary.fields().at("frames").number_value(), 4.0);
  EXPECT_EQ(summary.fields().at("gaps").number_value(), 1.0);
  EXPECT_DOUBLE_EQ(summary.fields().at("bits_per_vertex").number_value(),
                   8.0 * summary.fields().at("bytes").number_value() / 16.0);
}

TEST(CommandWatch, AsksForRateAndError) {
  v1::Subscribe sent;
  {
    const FakeServer server([&](FakeSession& session) {
      session.welcome();
      session.reply([&](const auto& request, auto& message) {
        sent = request.subscribe();
        fill_subscribed(1, message);
      });
      session.drain();
    });
    EXPECT_EQ(run(server, {"watch", "w", "--seconds", "0.01", "--rate", "30", "--max-error", "1e-4"}).exit_status, 0);
  }
  EXPECT_EQ(sent.rate_hz(), 30.0);
  EXPECT_EQ(sent.max_error_m(), 1e-4);
}

TEST(CommandWatch, AsksForBodiesLevelVelocitiesAndScalarsAndPrintsThem) {
  v1::Subscribe sent;
  Finished finished;
  {
    const FakeServer server([&](FakeSession& session) {
      session.welcome();
      session.reply([&](const auto& request, auto& message) {
        sent = request.subscribe();
        fill_subscribed(1, message);
        message.mutable_subscribed()->set_velocity_grid_step_m_s(1.0);
      });
      session.send(topology_message());
      session.send(layout_message(1));
      auto frame = key_frame(1, 1);
      frame.mutable_frame()->set_velocities(key_frame(1, 1, 2).frame().payload());
      v1::Scalars& scalars = *frame.mutable_frame()->mutable_scalars();
      scalars.add_volume_m3(0.25F);
      scalars.add_pressure_pa(100.0F);
      scalars.add_kinetic_j(2.0F);
      scalars.add_elastic_j(0.5F);
      scalars.add_asleep(true);
      v1::Contact& contact = *frame.mutable_frame()->add_contacts();
      contact.set_vertex(2);
      contact.set_other_solid(0);
      contact.mutable_normal()->set_y(1.0);
      session.send(frame);
      session.drain();
    });
    finished = run(server, {"watch", "--body", "ball", "--body", "second", "w", "--level", "2", "--velocities",
                            "--scalars", "--contacts", "--simulated", "--json", "--frames", "1"});
  }
  EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
  ASSERT_EQ(sent.bodies_size(), 2);
  EXPECT_EQ(sent.bodies(1), "second");
  EXPECT_EQ(sent.level_of_detail(), 2U);
  EXPECT_TRUE(sent.velocities());
  EXPECT_TRUE(sent.scalars());
  const auto frame = json(lines(finished.output).at(1));
  const auto& ball = frame.fields().at("bodies").list_value().values(0).struct_value();
  EXPECT_EQ(ball.fields().at("volume_m3").number_value(), 0.25);
  EXPECT_EQ(ball.fields().at("pressure_pa").number_value(), 100.0);
  EXPECT_EQ(ball.fields().at("kinetic_j").number_value(), 2.0);
  EXPECT_EQ(ball.fields().at("elastic_j").number_value(), 0.5);
  EXPECT_TRUE(ball.fields().at("asleep").bool_value());
  EXPECT_EQ(ball.fields().at("mean_velocity_m_s").list_value().values_size(), 3);
  EXPECT_GT(ball.fields().at("max_speed_m_s").number_value(), 0.0);
  EXPECT_TRUE(sent.contacts());
  EXPECT_TRUE(sent.simulated());
  const auto& contact = frame.fields().at("contacts").list_value().values(0).struct_value();
  EXPECT_EQ(contact.fields().at("body").string_value(), "ball");
  EXPECT_EQ(contact.fields().at("vertex").number_value(), 2.0);
  EXPECT_EQ(contact.fields().at("other_solid").string_value(), "floor");
  EXPECT_EQ(contact.fields().at("normal").list_value().values(1).number_value(), 1.0);
}

TEST(CommandWatch, StatsNameFrozenBodies) {
  for (const bool json_lines : {true, false}) {
    const FakeServer server([](FakeSession& session) {
      play(session);
      session.reply([](const auto& request, auto& message) {
        EXPECT_TRUE(request.has_get_stats());
        v1::Stats& stats = *message.mutable_stats();
        stats.add_streams()->set_stream_id(1);
        stats.add_soft_bodies()->set_name("ball");
        stats.add_rigid_bodies()->set_name("stone");
        stats.mutable_rigid_bodies(0)->set_frozen(true);
      });
      session.drain();
    });
    std::vector<std::string> arguments{"watch", "w", "--stats", "--frames", "1"};
    if (json_lines) arguments.push_back("--json");
    const Finished finished = run(server, arguments);
    EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
    EXPECT_NE(finished.output.find(json_lines ? R"("frozen":["stone"])" : "; frozen: stone\n"), std::string::npos)
        << finished.output;
  }
}

TEST(CommandWatch, WritesAWavefrontFileAFrame) {
  const auto folder = std::filesystem::temp_directory_path() / ("obj-" + std::to_string(getpid()));
  const FakeServer server([](FakeSession& session) {
    play(session);
    session.drain();
  });
  EXPECT_EQ(run(server, {"watch", "w", "--frames", "2", "--obj", folder.string()}).exit_status, 0);
  std::ifstream in(folder / "frame-000000002.obj");
  std::stringstream text;
  text << in.rdbuf();
  std::filesystem::remove_all(folder);
  EXPECT_EQ(text.str(),
            "o ball\nv 1 1 1\nv 2 1 1\nv 1 2 1\nv 1 1 2\n"
            "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
}

TEST(CommandWatch, InterruptEndsItWithASummaryAndExit0) {
  const FakeServer server([](FakeSession& session) {
    play(session);
    session.drain();
  });
  auto program = Program::start(support::program_path("pneuma"), {"--server", server.address(), "watch", "w"});
  ASSERT_TRUE(program.ok());
  ASSERT_TRUE(program->next_line(long_enough).ok());  // it watches
  program->send_signal(SIGINT);
  const auto exit_status = program->wait(long_enough);
  ASSERT_TRUE(exit_status.ok());
  EXPECT_EQ(*exit_status, 0);
  EXPECT_NE(lines(program->output()).back().find("bits a vertex"), std::string::npos);
}

TEST(CommandWatch, ReaderThatGoesAwayEndsItQuietly) {
  const FakeServer server([](FakeSession& session) {
    play(session);
    for (std::uint64_t tick = 20; tick < 20'000; ++tick) session.send(key_frame(1, tick));
    session.drain();
  });
  auto program = Program::start(support::program_path("pneuma"), {"--server", server.address(), "watch", "w"});
  ASSERT_TRUE(program.ok());
  ASSERT_TRUE(program->next_line(long_enough).ok());
  program->close_output();
  const auto exit_status = program->wait(long_enough);
  ASSERT_TRUE(exit_status.ok());
  EXPECT_EQ(*exit_status, 0);
  EXPECT_EQ(program->error_output(), "");
}

TEST(CommandWatch, DestroyedWorldFails) {
  const FakeServer server([](FakeSession& session) {
    play(session);
    v1::ServerMessage event;
    event.mutable_event()->set_kind(v1::Event::WORLD_DESTROYED);
    event.mutable_event()->set_world("w");
    session.send(event);
    session.drain();
  });
  const Finished finished = run(server, {"watch", "w"});
  EXPECT_EQ(finished.exit_status, 1);
  EXPECT_EQ(finished.error_output, "pneuma: w: the world was destroyed\n");
  EXPECT_NE(finished.output.find("3 frames, 1 gap, "), std::string::npos) << finished.output;
}

TEST(CommandWatch, BrokenConnectionFailsWithASummary) {
  const FakeServer server([](FakeSession& session) { play(session); });
  const Finished finished = run(server, {"watch", "w"});
  EXPECT_EQ(finished.exit_status, 1);
  EXPECT_EQ(finished.error_output, "pneuma: the server closed the connection\n");
  EXPECT_NE(finished.output.find("3 frames"), std::string::npos);
}

}  // namespace
}  // namespace pneuma::client
