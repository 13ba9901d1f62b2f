// Shows `pneuma record` as a shell sees it: what it asks the server for, what is in the file however it ends, and how
// it tells how far it is.
#include <csignal>
#include <fstream>

#include <gtest/gtest.h>

#include "pneuma_client/playback.h"
#include "support/temporary_folder.h"
#include "unit/client/command_runner.h"
#include "unit/client/fake_server.h"

namespace pneuma::client {
namespace {

using support::Finished;
using support::Program;

/// Answers what is asked before the stream begins, and sends three frames.
v1::Subscribe begin(FakeSession& session) {
  v1::Subscribe asked;
  session.welcome();
  session.reply([](const auto&, auto& message) { message.mutable_stats()->set_rate_hz(60.0); });
  session.reply([](const auto&, auto& message) { message.mutable_scene()->mutable_scene()->set_name("s"); });
  session.reply([&](const auto& request, auto& message) {
    asked = request.subscribe();
    fill_subscribed(1, message);
  });
  session.send(topology_message());
  session.send(layout_message(1));
  session.send(key_frame(1, 1));
  session.send(delta_frame(1, 2, 1, 1000, 0));
  session.send(key_frame(1, 3));
  return asked;
}

class CommandRecord : public testing::Test {
 protected:
  /// Frames in the file, which must be whole.
  [[nodiscard]] std::uint64_t frames() const {
    const auto playback = Playback::open(file_);
    EXPECT_TRUE(playback.ok()) << playback.status().message();
    if (!playback.ok()) return 0;
    EXPECT_TRUE(playback->damage().ok()) << playback->damage().message();
    EXPECT_EQ(playback->header().world(), "w");
    EXPECT_EQ(playback->header().scene().name(), "s");
    return playback->index().frames();
  }

  support::TemporaryFolder folder_;
  std::string file_ = folder_ / "w.pneuma";
};

TEST_F(CommandRecord, AsksForCommandsAndKeysAndEndsAtTheFrameAskedFor) {
  v1::Subscribe asked;
  {
    const FakeServer server([&](FakeSession& session) {
      asked = begin(session);
      session.drain();
    });
    const Finished finished = run(server, {"record", "w", file_, "--frames", "2", "--key-every", "0.5", "--json"});
    EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
    const auto told = json(lines(finished.output).back());
    EXPECT_EQ(told.fields().at("type").string_value(), "recording");
    EXPECT_EQ(told.fields().at("frames").number_value(), 2.0);
  }
  EXPECT_TRUE(asked.commands());
  EXPECT_EQ(asked.key_interval_s(), 0.5);
  EXPECT_EQ(frames(), 2U);
}

TEST_F(CommandRecord, ABrokenConnectionLeavesAWholeFileAndExit1) {
  {
    const FakeServer server([](FakeSession& session) { begin(session); });
    const Finished finished = run(server, {"record", "w", file_});
    EXPECT_EQ(finished.exit_status, 1);
    EXPECT_NE(finished.error_output.find("closed"), std::string::npos) << finished.error_output;
  }
  EXPECT_EQ(frames(), 3U);
}

TEST_F(CommandRecord, AnInterruptLeavesAWholeFileAndExit0) {
  {
    const FakeServer server([](FakeSession& session) {
      begin(session);
      session.drain();
    });
    auto program =
        Program::start(support::program_path("pneuma"), {"--server", server.address(), "record", "w", file_});
    ASSERT_TRUE(program.ok());
    // The file is there once the interrupt is caught.
    while (program->is_running() && !std::ifstream(file_).good()) {
    }
    program->send_signal(SIGINT);
    const auto exit_status = program->wait(long_enough);
    ASSERT_TRUE(exit_status.ok());
    EXPECT_EQ(*exit_status, 0) << program->error_output();
  }
  (void)frames();
}

TEST_F(CommandRecord, ADestroyedWorldIsToldAndTheFileIsWhole) {
  {
    const FakeServer server([](FakeSession& session) {
      begin(session);
      v1::ServerMessage event;
      event.mutable_event()->set_kind(v1::Event::WORLD_DESTROYED);
      event.mutable_event()->set_world("w");
      session.send(event);
      session.drain();
    });
    EXPECT_EQ(run(server, {"record", "w", file_}).exit_status, 1);
  }
  EXPECT_EQ(frames(), 3U);
}

TEST_F(CommandRecord, AFileThatIsThereIsLeftAlone) {
  std::ofstream(file_) << "mine";
  const FakeServer server([](FakeSession& session) {
    begin(session);
    session.drain();
  });
  const Finished finished = run(server, {"record", "w", file_});
  EXPECT_EQ(finished.exit_status, 1);
  EXPECT_NE(finished.error_output.find("--force"), std::string::npos) << finished.error_output;
}

}  // namespace
}  // namespace pneuma::client
