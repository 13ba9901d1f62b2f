// Shows the way of a world through a file: `pneuma record` of a real server's world, its frames and its log of changes
// read back, and `pneuma play` of it to clients who take it for a world.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <fstream>
#include <map>
#include <set>

#include "pneuma_client/playback.h"
#include "raw_connection.h"
#include "served.h"
#include "support/temporary_folder.h"

namespace pneuma::integration {
namespace {

using support::Finished;
using support::Program;

class RecordingPrograms : public Served {
 protected:
  void SetUp() override { start(); }

  /// Positions of all bodies by tick, as a client sees them at the recording's own bound.
  using Seen = std::map<std::uint64_t, std::vector<client::SoftBodyFrame>>;

  /// Records a paused world from tick 0 to `ticks`, and subscribes to the same; a hit comes after 10 ticks, an edit
  /// after 20.
  Seen record(client::Client& client, std::uint32_t ticks, bool simulated = false) {
    create(client, two_balls(), "w", true);
    std::vector<std::string> arguments{"--server", server_->tcp_address(),    "record",      "w",  file_,
                                       "--frames", std::to_string(ticks + 2), "--key-every", "0.2"};
    if (simulated) arguments.emplace_back("--simulated");
    auto recorder = Program::start(support::program_path("pneuma"), arguments);
    EXPECT_TRUE(recorder.ok());
    // The file is made once the recorder has subscribed.
    while (recorder->is_running() && !std::ifstream(file_).good()) {
    }
    EXPECT_TRUE(client.subscribe("w", {.simulated = simulated}).ok());
    Seen seen;
    const auto step = [&](std::uint32_t count) {
      EXPECT_TRUE(client.step("w", count).ok());
      // Of several frames of a tick, as after an edit, the last one counts.
      while (true) {
        auto frame = client.next_frame(std::chrono::milliseconds(0));
        if (!frame.ok() || !*frame) break;
        seen[(*frame)->tick] = (*frame)->bodies;
      }
    };
    step(10);
    v1::Impulse impulse;
    impulse.set_world("w");
    impulse.set_body("left");
    *impulse.mutable_impulse() = vec(0.0, 3.0, 0.0);
    EXPECT_TRUE(client.impulse(impulse).ok());
    step(10);
    v1::SceneEdit edit;
    edit.add_changes()->mutable_set_gravity()->set_y(-3.0);
    EXPECT_TRUE(client.edit("w", edit).ok());
    step(ticks - 20);
    // A reader sees what is there of a file that is being written.
    while (recorder->is_running() && last_tick() != ticks) {
    }
    recorder->send_signal(SIGINT);
    const auto exit_status = recorder->wait(patience);
    EXPECT_TRUE(exit_status.ok()) << exit_status.status().message();
    EXPECT_EQ(exit_status.ok() ? *exit_status : -1, 0) << recorder->error_output();
    return seen;
  }

  /// In the file so far.
  [[nodiscard]] std::uint64_t last_tick() const {
    const auto reader = client::RecordingReader::open(file_);
    return reader.ok() ? reader->index().last_tick() : 0;
  }

  static double furthest_m(const client::SoftBodyFrame& a, const client::SoftBodyFrame& b) {
    double furthest = 0.0;
    for (std::size_t i = 0; i + 2 < a.positions_m.size(); i += 3) {
      furthest = std::max(furthest,
                          std::hypot(a.positions_m[i] - b.positions_m[i], a.positions_m[i + 1] - b.positions_m[i + 1],
                                     a.positions_m[i + 2] - b.positions_m[i + 2]));
    }
    return furthest;
  }

  support::TemporaryFolder folder_;
  std::string file_ = folder_ / "w.pneuma";
};

class RecordingsOfAnyStream : public RecordingPrograms, public testing::WithParamInterface<bool> {};

TEST_P(RecordingsOfAnyStream, HoldWhatASubscriberSees) {
  client::Client client = connect();
  const Seen seen = record(client, 60, GetParam());
  auto playback = client::Playback::open(file_);
  ASSERT_TRUE(playback.ok()) << playback.status().message();
  EXPECT_TRUE(playback->damage().ok());
  std::set<std::uint64_t> ticks;                       // each is there, or in a gap: the recorder may be slow
  std::map<std::uint64_t, client::DecodedFrame> last;  // of each tick: an edit is shown by another frame of it
  bool gaps = false;
  while (true) {
    auto recorded = playback->next();
    ASSERT_TRUE(recorded.ok()) << recorded.status().message();
    if (!*recorded) break;
    if (const auto* gap = std::get_if<v1::Gap>(&**recorded)) {
      gaps = true;
      for (std::uint64_t tick = gap->from_tick(); tick <= gap->to_tick(); ++tick) ticks.insert(tick);
    }
    const auto* frame = std::get_if<client::RecordedFrame>(&**recorded);
    if (frame == nullptr) continue;
    ticks.insert(frame->frame.tick);
    last.insert_or_assign(frame->frame.tick, frame->frame);
  }
  for (const auto& [tick, bodies] : seen) {
    const auto found = last.find(tick);
    if (found == last.end()) continue;  // in a gap
    for (std::size_t body = 0; body < 2; ++body) {
      EXPECT_EQ(found->second.bodies[body].positions_m, bodies[body].positions_m) << "tick " << tick;
    }
  }
  EXPECT_EQ(ticks.size(), 61U);
  EXPECT_EQ(*ticks.begin(), 0U);
  EXPECT_EQ(*ticks.rbegin(), 60U);
  const auto& keys = playback->index().keys();
  for (int i = 1; i < keys.size() && !gaps; ++i) EXPECT_LE(keys[i].at_s() - keys[i - 1].at_s(), 0.2 + 1e-9);
}

TEST_F(RecordingPrograms, TheLogOfChangesMakesTheSameWorldAgain) {
  client::Client client = connect();
  record(client, 60);
  const std::uint64_t hash = client.stats("w")->state_hash();

  auto playback = client::Playback::open(file_);
  ASSERT_TRUE(playback.ok());
  create(client, playback->header().scene(), "again", true);
  const auto step_to = [&](std::uint64_t tick) {
    const std::uint64_t now = client.stats("again")->tick();
    if (tick <= now) return;
    EXPECT_TRUE(client.step("again", static_cast<std::uint32_t>(tick - now)).ok());
  };
  while (true) {
    auto recorded = playback->next();
    ASSERT_TRUE(recorded.ok());
    if (!*recorded) break;
    const auto* applied = std::get_if<v1::Applied>(&**recorded);
    if (applied == nullptr) continue;
    step_to(applied->tick());
    v1::ClientMessage command = applied->command();
    if (command.has_impulse()) command.mutable_impulse()->set_world("again");
    if (command.has_edit()) command.mutable_edit()->set_world("again");
    ASSERT_TRUE(client.call(command).ok());
  }
  EXPECT_EQ(playback->index().commands(), 2U);
  step_to(60);
  EXPECT_EQ(client.stats("again")->state_hash(), hash);
}

TEST_P(RecordingsOfAnyStream, AreTakenForTheWorldWherePlayed) {
  client::Client client = connect();
  record(client, 60, GetParam());
  std::map<std::uint64_t, client::DecodedFrame> recorded;
  auto playback = client::Playback::open(file_);
  ASSERT_TRUE(playback.ok());
  for (auto one = playback->next(); one.ok() && *one; one = playback->next()) {
    if (auto* frame = std::get_if<client::RecordedFrame>(&**one)) recorded[frame->frame.tick] = std::move(frame->frame);
  }
  /// Of the last frame not later.
  const auto tick_at = [&](std::uint64_t tick) { return std::prev(recorded.upper_bound(tick))->first; };
  auto player = Program::start(support::program_path("pneuma"), {"play", file_, "--paused", "--http", "127.0.0.1:0"});
  ASSERT_TRUE(player.ok());
  const auto ready = player->next_line(patience);
  ASSERT_TRUE(ready.ok()) << player->error_output();
  const std::string address = ready->substr(ready->find("tcp=") + 4, ready->find(" http=") - ready->find("tcp=") - 4);
  const auto pneuma = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--server", address});
    return support::run_program("pneuma", arguments);
  };
  const Finished worlds = pneuma({"worlds"});
  EXPECT_NE(worlds.output.find("paused"), std::string::npos) << worlds.output << worlds.error_output;
  EXPECT_NE(pneuma({"scene", "w"}).output.find("two-balls"), std::string::npos);
  const Finished watched = pneuma({"watch", "w", "--frames", "1"});
  EXPECT_NE(watched.output.find("tick 0 "), std::string::npos) << watched.output << watched.error_output;
  const Finished refused = pneuma({"impulse", "w", "left", "--impulse", "0,1,0", "--json"});
  EXPECT_EQ(refused.exit_status, 1);
  EXPECT_NE(refused.error_output.find("FAILED_PRECONDITION"), std::string::npos) << refused.error_output;
  EXPECT_EQ(pneuma({"seek", "w", "1e6"}).exit_status, 1);
  EXPECT_EQ(pneuma({"seek", "w", "0.5"}).output, "went to w at tick " + std::to_string(tick_at(30)) + "\n");

  // Two clients see the recorded frames, within the bound that each is told.
  std::vector<client::Client> viewers;
  for (const double max_error_m : {0.0, 0.004}) {
    auto viewer = client::Client::connect(address);
    ASSERT_TRUE(viewer.ok());
    const auto subscribed = viewer->subscribe("w", {.max_error_m = max_error_m});
    ASSERT_TRUE(subscribed.ok()) << subscribed.status().message();
    const double added_m = subscribed->max_error_m() - playback->header().stream().max_error_m();
    ASSERT_TRUE(viewer->step("w", 3).ok());
    std::uint64_t last_tick = 0;
    const auto stepped_to = viewer->stats("w")->tick();
    while (last_tick != stepped_to) {
      const auto frame = await_frame(*viewer);
      ASSERT_TRUE(frame);
      last_tick = frame->tick;
      const auto original = recorded.find(frame->tick);
      ASSERT_NE(original, recorded.end());
      for (std::size_t body = 0; body < 2; ++body) {
        EXPECT_LE(furthest_m(frame->bodies[body], original->second.bodies[body]), added_m);
      }
    }
    viewers.push_back(std::move(*viewer));
  }
  EXPECT_EQ(viewers[0].list_worlds()->worlds(0).subscribers(), 2U);
  const std::uint64_t sought = tick_at(15);
  EXPECT_EQ(viewers[0].seek("w", 0.25)->tick(), sought);
  for (client::Client& viewer : viewers) {
    EXPECT_TRUE(await_frame(viewer, [&](const auto& frame) { return frame.tick == sought; }));
  }
  player->send_signal(SIGTERM);
  const auto exit_status = player->wait(patience);
  ASSERT_TRUE(exit_status.ok());
  EXPECT_EQ(*exit_status, 0) << player->error_output();
}

INSTANTIATE_TEST_SUITE_P(Streams, RecordingsOfAnyStream, testing::Bool(),
                         [](const auto& info) { return info.param ? "Simulated" : "Plain"; });

TEST_F(RecordingPrograms, WhatIsPlayedIsShownByThePageToo) {
  client::Client client = connect();
  record(client, 60);
  const support::TemporaryFolder folder;
  std::ofstream(folder / "index.html") << "<!doctype html>";
  auto player = Program::start(support::program_path("pneuma"), {"play", file_, "--web-dir", folder.path()});
  ASSERT_TRUE(player.ok());
  const auto ready = player->next_line(patience);
  ASSERT_TRUE(ready.ok()) << player->error_output();
  const std::string address = ready->substr(ready->find("http=") + 5);
  const auto get = [&](const std::string& path) {
    RawConnection connection(address);
    EXPECT_TRUE(connection.send(std::string("GET ").append(path).append(" HTTP/1.0\r\nHost: localhost\r\n\r\n")));
    return connection.receive_to_end();
  };
  EXPECT_TRUE(get("/").ends_with("<!doctype html>"));
  EXPECT_NE(get("/worlds").find("1 world\n"), std::string::npos);
  EXPECT_NE(get("/ws").find(" 426 "), std::string::npos) << "for WebSockets";
}

}  // namespace
}  // namespace pneuma::integration
