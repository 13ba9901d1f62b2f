// Shows that worlds outlive the server: after SIGTERM, and after SIGKILL, they come back with the same bits, edits,
// pause and all.
#include <csignal>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>

#include "raw_connection.h"
#include "served.h"
#include "support/sanitizers.h"

namespace pneuma::integration {
namespace {

class Restart : public Served {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "pneuma-restart-XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    start(arguments());
  }
  void TearDown() override {
    server_.reset();
    std::filesystem::remove_all(folder_);
  }

  [[nodiscard]] std::vector<std::string> arguments() const { return {"--data-dir", folder_.string() + "/data"}; }

  void restart_after_kill() {
    server_->kill();
    start(arguments());
  }

  static v1::Impulse push(const std::string& world, double x) {
    v1::Impulse impulse;
    impulse.set_world(world);
    impulse.set_body("left");
    impulse.set_vertex(5);
    *impulse.mutable_impulse() = vec(x, 0.1, 0.0);
    return impulse;
  }

  std::filesystem::path folder_;
};

TEST_F(Restart, AfterSigkillTheCommandsSinceTheCheckpointAreReplayedToTheSameHash) {
  std::uint64_t hash = 0;
  {
    client::Client client = connect();
    create(client, two_balls(), "w", true);
    ASSERT_TRUE(client.step("w", 7).ok());
    ASSERT_TRUE(client.impulse(push("w", 0.5)).ok());
    ASSERT_TRUE(client.step("w", 5).ok());
    v1::SceneEdit edit;
    auto& third = *edit.add_changes()->mutable_add_soft_body();
    third = two_balls().soft_bodies(0);
    third.set_name("third");
    third.mutable_position()->set_x(8.0);
    *edit.add_changes()->mutable_set_gravity() = vec(0.0, -3.7, 0.0);
    ASSERT_TRUE(client.edit("w", edit).ok());
    v1::Grab grab;
    grab.set_world("w");
    grab.set_body("third");
    grab.set_vertex(9);
    *grab.mutable_target() = vec(8.0, 5.0, 0.0);
    const auto grabbed = client.grab(grab);
    ASSERT_TRUE(grabbed.ok());
    ASSERT_TRUE(client.step("w", 6).ok());
    ASSERT_TRUE(client.move_grab("w", grabbed->grab_id(), vec(7.0, 6.0, 1.0)).ok());
    ASSERT_TRUE(client.step("w", 4).ok());
    // Held on, it would be released at the restart: its session is gone then.
    ASSERT_TRUE(client.release_grab("w", grabbed->grab_id()).ok());
    ASSERT_TRUE(client.step("w", 5).ok());
    hash = client.stats("w")->state_hash();
  }
  restart_after_kill();
  client::Client client = connect();
  const auto stats = client.stats("w");
  ASSERT_TRUE(stats.ok()) << stats.status().message() << server_->error_output();
  EXPECT_EQ(stats->tick(), 27U);
  EXPECT_TRUE(stats->paused());
  EXPECT_EQ(stats->state_hash(), hash);
  EXPECT_EQ(stats->soft_bodies_size(), 3);
  EXPECT_EQ(client.scene("w")->scene().gravity().y(), -3.7);
}

TEST_F(Restart, AWorldThatRanGoesOnAsIfItHadNotBeenKilled) {
  // The reference: the same commands at the same ticks, on a server that lives.
  std::uint64_t hit_tick = 0;
  std::uint64_t pause_tick = 0;
  {
    client::Client client = connect();
    create(client, two_balls(), "w");
    ASSERT_TRUE(client.subscribe("w").ok());
    ASSERT_TRUE(await_frame(client, [](const auto& frame) { return frame.tick > 10; }));
    const auto hit = client.impulse(push("w", 0.7));
    ASSERT_TRUE(hit.ok());
    hit_tick = hit->tick() - 1;
    ASSERT_TRUE(await_frame(client, [&](const auto& frame) { return frame.tick > hit_tick + 10; }));
    const auto paused = client.pause("w");
    ASSERT_TRUE(paused.ok());
    pause_tick = paused->tick();
  }
  restart_after_kill();
  client::Client client = connect();
  ASSERT_EQ(client.stats("w")->tick(), pause_tick);
  create(client, two_balls(), "reference", true);
  ASSERT_TRUE(client.step("reference", static_cast<std::uint32_t>(hit_tick)).ok());
  ASSERT_TRUE(client.impulse(push("reference", 0.7)).ok());
  ASSERT_TRUE(client.step("reference", static_cast<std::uint32_t>(pause_tick - hit_tick)).ok());
  EXPECT_EQ(client.stats("w")->state_hash(), client.stats("reference")->state_hash());
  // And from there on.
  ASSERT_TRUE(client.step("w", 30).ok());
  ASSERT_TRUE(client.step("reference", 30).ok());
  EXPECT_EQ(client.stats("w")->state_hash(), client.stats("reference")->state_hash());
}

TEST_F(Restart, SigtermSaysGoodbyeChecksPointsAndExitsZero) {
  std::uint64_t hash = 0;
  {
    client::Client client = connect();
    create(client, two_balls(), "w", true);
    create(client, two_balls(), "runs");
    ASSERT_TRUE(client.step("w", 25).ok());
    hash = client.stats("w")->state_hash();
    RawConnection raw(server_->tcp_address());
    ASSERT_TRUE(raw.say_hello());
    server_->send_signal(SIGTERM);
    EXPECT_TRUE(raw.ends());
    EXPECT_EQ(raw.goodbye(), v1::Error::UNAVAILABLE);
    const auto status = server_->wait(patience);
    ASSERT_TRUE(status.ok());
    EXPECT_EQ(*status, 0) << server_->error_output();
  }
  start(arguments());
  client::Client client = connect();
  EXPECT_EQ(client.stats("w")->state_hash(), hash);
  EXPECT_EQ(client.stats("w")->tick(), 25U);
  EXPECT_FALSE(client.stats("runs")->paused());
}

TEST_F(Restart, SigtermAnswersWhatItReceivedBeforeItsGoodbyes) {
  constexpr std::size_t watchers = 20;
  client::Client client = connect();
  create(client, two_balls(), "runs");
  create(client, two_balls(), "steps", true);
  std::vector<std::unique_ptr<RawConnection>> connections;
  for (std::size_t i = 0; i < watchers; ++i) {
    connections.push_back(std::make_unique<RawConnection>(server_->tcp_address()));
    ASSERT_TRUE(connections.back()->say_hello());
    v1::ClientMessage subscribe;
    subscribe.set_request_id(2);
    subscribe.mutable_subscribe()->set_world("runs");
    ASSERT_TRUE(connections.back()->send(subscribe));
    ASSERT_TRUE(connections.back()->receive_reply(2));
  }
  RawConnection stepper(server_->tcp_address());
  ASSERT_TRUE(stepper.say_hello());
  v1::ClientMessage step;
  step.set_request_id(2);
  step.mutable_step()->set_world("steps");
  step.mutable_step()->set_ticks(36'000);
  v1::ClientMessage ping;
  ping.set_request_id(3);
  ping.mutable_ping();
  ASSERT_TRUE(stepper.send(step));
  ASSERT_TRUE(stepper.send(ping));
  ASSERT_TRUE(stepper.receive_reply(3)) << "the step was received before this";

  server_->send_signal(SIGTERM);
  const auto reply = stepper.receive_reply(2);
  ASSERT_TRUE(reply) << "no reply to the step before the goodbye";
  EXPECT_TRUE(reply->has_done() || reply->error().code() == v1::Error::UNAVAILABLE) << reply->error().what();
  EXPECT_TRUE(stepper.ends());
  EXPECT_EQ(stepper.goodbye(), v1::Error::UNAVAILABLE);
  for (auto& connection : connections) {
    EXPECT_TRUE(connection->ends());
    EXPECT_EQ(connection->goodbye(), v1::Error::UNAVAILABLE);
  }
  const auto status = server_->wait(patience);
  ASSERT_TRUE(status.ok());
  EXPECT_EQ(*status, 0) << server_->error_output();
}

// A replay of so much motion takes long enough to be looked at while it is under way.
class RestartWithMotion : public Restart {
 protected:
  void SetUp() override {
    Restart::SetUp();
    start(without_checkpoints());
    client::Client client = connect();
    create(client, two_balls(), "moved", true);
    // Some seconds to replay; the thread sanitizer takes twenty times as long.
    const auto stepped = client.step("moved", support::is_thread_sanitized ? 2'000 : 20'000);
    ASSERT_TRUE(stepped.ok()) << stepped.status().message();
    hash_ = client.stats("moved")->state_hash();
    server_->kill();
  }
  [[nodiscard]] std::vector<std::string> without_checkpoints() const {
    auto flags = arguments();
    flags.insert(flags.end(), {"--checkpoint-interval-s", "1000"});
    return flags;
  }
  void start_without_waiting() {
    auto server = support::ServerProcess::start(without_checkpoints(), patience, support::ErrorOutput::kept,
                                                support::KeptWorlds::on_their_way);
    if (!server.ok()) throw std::runtime_error(server.status().message());
    server_.emplace(std::move(*server));
  }
  using Page = std::pair<std::string, std::string>;  // status and body
  [[nodiscard]] Page page(const std::string& path) const {
    RawConnection connection(server_->http_address());
    EXPECT_TRUE(connection.send("GET " + path + " HTTP/1.0\r\nHost: localhost\r\n\r\n"));
    const std::string reply = connection.receive_to_end();
    if (reply.size() < 12) return {};
    return {reply.substr(9, 3), reply.substr(reply.find("\r\n\r\n") + 4)};
  }

  std::uint64_t hash_ = 0;
};

TEST_F(RestartWithMotion, ItListensAtOnceAndSaysHowManyWorldsAreUp) {
  start_without_waiting();
  client::Client client = connect();
  const auto early = client.stats("moved");
  EXPECT_EQ(early.status().code(), base::StatusCode::unavailable) << early.status().message();
  EXPECT_NE(early.status().message().find("1 of 1 kept worlds are not up yet (try again in 1 s)"), std::string::npos)
      << early.status().message();
  EXPECT_EQ(page("/readyz"), Page("503", "0 of 1 worlds are up\n"));
  EXPECT_EQ(page("/livez"), Page("200", "ok\n"));
  EXPECT_EQ(page("/healthz"), Page("200", "ok\n"));
  EXPECT_TRUE(client.list_worlds()->worlds(0).restoring());
  EXPECT_EQ(client.create_builtin("bouncing-ball", "moved").status().code(), base::StatusCode::already_exists);
  create(client, two_balls(), "other", true);
  EXPECT_TRUE(client.step("other", 10).ok()) << "other worlds go on meanwhile";

  const auto line = server_->await_kept_worlds(patience);
  ASSERT_TRUE(line.ok()) << line.status().message();
  EXPECT_EQ(*line, "worlds up=1 damaged=0");
  EXPECT_EQ(page("/readyz"), Page("200", "2 of 2 worlds are up\n"));
  EXPECT_EQ(client.stats("moved")->state_hash(), hash_);
  EXPECT_FALSE(client.list_worlds()->worlds(0).restoring());
}

TEST_F(RestartWithMotion, ASigtermInTheMiddleOfItLosesNothing) {
  start_without_waiting();
  server_->send_signal(SIGTERM);
  const auto status = server_->wait(patience);
  ASSERT_TRUE(status.ok());
  EXPECT_EQ(*status, 0) << server_->error_output();
  start(without_checkpoints());
  EXPECT_EQ(connect().stats("moved")->state_hash(), hash_);
}

TEST_F(Restart, ADestroyedWorldDoesNotComeBack) {
  {
    client::Client client = connect();
    create(client, two_balls(), "gone", true);
    create(client, two_balls(), "kept", true);
    ASSERT_TRUE(client.destroy_world("gone").ok());
  }
  restart_after_kill();
  client::Client client = connect();
  const auto list = client.list_worlds();
  ASSERT_EQ(list->worlds_size(), 1);
  EXPECT_EQ(list->worlds(0).name(), "kept");
}

TEST_F(Restart, ASceneFlagDoesNotReplaceTheWorldThatIsThere) {
  auto with_scene = arguments();
  with_scene.insert(with_scene.end(), {"--scene", "bouncing-ball"});
  start(with_scene);
  {
    client::Client client = connect();
    ASSERT_TRUE(client.pause("bouncing-ball").ok());
    ASSERT_TRUE(client.step("bouncing-ball", 40).ok());
  }
  server_->kill();
  start(with_scene);
  client::Client client = connect();
  EXPECT_EQ(client.list_worlds()->worlds_size(), 1);
  EXPECT_GE(client.stats("bouncing-ball")->tick(), 40U);
}

TEST_F(Restart, ResetWorldsComeBackTheSameToo) {
  std::uint64_t hash = 0;
  {
    client::Client client = connect();
    create(client, two_balls(), "w", true);
    ASSERT_TRUE(client.step("w", 10).ok());
    ASSERT_TRUE(client.reset("w").ok());
    ASSERT_TRUE(client.impulse(push("w", 1.0)).ok());
    ASSERT_TRUE(client.step("w", 10).ok());
    hash = client.stats("w")->state_hash();
  }
  restart_after_kill();
  client::Client client = connect();
  EXPECT_EQ(client.stats("w")->tick(), 20U);
  EXPECT_EQ(client.stats("w")->state_hash(), hash);
  restart_after_kill();
  EXPECT_EQ(connect().stats("w")->state_hash(), hash) << "a restart right after a restart";
}

}  // namespace
}  // namespace pneuma::integration
