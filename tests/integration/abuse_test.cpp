// Shows that requests which come in bursts, too late or in an odd order harm nobody: worlds destroyed under a pipeline
// of requests, a flood of answers to pings, changes to a world at rest, and one client's burst beside another client's
// world.
#include <chrono>
#include <filesystem>
#include <iterator>
#include <map>
#include <string>

#include "raw_connection.h"
#include "served.h"
#include "support/sanitizers.h"

namespace pneuma::integration {
namespace {

class Abuse : public Served {
 protected:
  static v1::ClientMessage create_paused(std::uint64_t request_id, const std::string& world) {
    v1::ClientMessage message;
    message.set_request_id(request_id);
    message.mutable_create_world()->set_name(world);
    message.mutable_create_world()->set_paused(true);
    *message.mutable_create_world()->mutable_scene() = two_balls();
    return message;
  }
};

TEST_F(Abuse, AWorldDestroyedUnderAPipelineOfRequestsAnswersEachOnce) {
  start({"--commands-per-s", "100000", "--commands-burst", "100000"});
  RawConnection connection(server_->tcp_address());
  ASSERT_TRUE(connection.say_hello());
  constexpr std::uint64_t requests_after = 40;
  std::uint64_t id = 100;
  for (int round = 0; round < 60; ++round) {
    ASSERT_TRUE(connection.send(create_paused(++id, "short-lived")));
    const auto created = connection.receive_reply(id);
    ASSERT_TRUE(created && created->has_done()) << created->error().what();
    std::string pipeline;
    v1::ClientMessage destroy;
    const std::uint64_t destroy_id = ++id;
    destroy.set_request_id(destroy_id);
    destroy.mutable_destroy_world()->set_world("short-lived");
    pipeline += RawConnection::envelope(destroy.SerializeAsString());
    for (std::uint64_t i = 0; i < requests_after; ++i) {
      v1::ClientMessage stats;
      stats.set_request_id(++id);
      stats.mutable_get_stats()->set_world("short-lived");
      pipeline += RawConnection::envelope(stats.SerializeAsString());
    }
    ASSERT_TRUE(connection.send(pipeline));
    std::map<std::uint64_t, int> replies;
    for (std::uint64_t i = 0; i <= requests_after; ++i) {
      const auto reply = connection.receive();
      ASSERT_TRUE(reply) << "round " << round;
      ++replies[reply->request_id()];
      if (reply->request_id() == destroy_id) {
        EXPECT_TRUE(reply->has_done());
      }
    }
    EXPECT_EQ(replies.size(), requests_after + 1);
  }
  EXPECT_TRUE(server_->is_running());
}

TEST_F(Abuse, AnswersToPingsAreNoCommands) {
  start({"--commands-burst", "2", "--commands-per-s", "1"});
  RawConnection connection(server_->tcp_address());
  ASSERT_TRUE(connection.say_hello());
  v1::ClientMessage pong;
  pong.mutable_pong()->set_nonce(12345);
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(connection.send(pong));
  v1::ClientMessage list;
  list.set_request_id(7);
  list.mutable_list_worlds();
  ASSERT_TRUE(connection.send(list));
  const auto reply = connection.receive();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->request_id(), 7U);  // and no error for a pong before it
  EXPECT_TRUE(reply->has_world_list());
}

TEST_F(Abuse, AnEditOfAWorldAtRestShowsAtTheTickItsReplyNames) {
  start();
  client::Client client = connect();
  create(client, two_balls(), "rest", true);
  ASSERT_TRUE(client.step("rest", 5).ok());
  ASSERT_TRUE(client.subscribe("rest").ok());
  ASSERT_TRUE(await_frame(client));
  v1::SceneEdit edit;
  v1::RigidBodyChange& change = *edit.add_changes()->mutable_change_rigid_body();
  change.set_name("stone");
  change.mutable_position()->set_y(9.0);
  const auto done = client.edit("rest", edit);
  ASSERT_TRUE(done.ok()) << done.status().message();
  const auto frame = await_frame(client, [](const client::DecodedFrame& shown) {
    for (const auto& solid : shown.solids) {
      if (solid.name == "stone" && solid.position.y() == 9.0) return true;
    }
    return false;
  });
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->tick, done->tick());
}

TEST_F(Abuse, OneClientsBurstOfHeavyRequestsDoesNotHoldUpAnothersWorld) {
  start({"--threads", "1", "--commands-per-s", "100000", "--commands-burst", "100000"});
  client::Client client = connect();
  create(client, light_and_quick(), "light");
  v1::CreateWorld heavy;
  heavy.set_name("heavy");
  heavy.set_builtin("cost-curve");
  heavy.set_paused(true);
  ASSERT_TRUE(client.create_world(heavy).ok());
  RawConnection burst(server_->tcp_address());
  ASSERT_TRUE(burst.say_hello());
  constexpr std::uint64_t resets = support::is_sanitized ? 15 : 60;  // one takes a second there
  std::string pipeline;
  for (std::uint64_t i = 1; i <= resets; ++i) {
    v1::ClientMessage reset;
    reset.set_request_id(i);
    reset.mutable_reset()->set_world("heavy");
    pipeline += RawConnection::envelope(reset.SerializeAsString());
  }
  const auto before = client.stats("light");
  ASSERT_TRUE(before.ok());
  ASSERT_TRUE(burst.send(pipeline));
  ASSERT_TRUE(burst.receive_reply(resets));
  const auto after = client.stats("light");
  ASSERT_TRUE(after.ok());
  // A reset fills a slice, and the one thread turns to the light world after each.
  EXPECT_GE(after->tick() - before->tick(), resets / 4);
}

// More in all than may be open at once, and as fast as one client can.
TEST_F(Abuse, AStormOfConnectionsLeavesNothingBehind) {
  start();
  client::Client client = connect();
  create(client, light_and_quick(), "light");
  const auto before = client.stats("light");
  ASSERT_TRUE(before.ok());
  for (std::size_t i = 0; i < 3'000; ++i) {
    RawConnection connection(i % 3 == 0 ? server_->http_address() : server_->tcp_address());
    if (i % 2 == 0) connection.send(std::string(1 + i % 7, '\0'));
  }
  const auto after = client.stats("light");
  ASSERT_TRUE(after.ok()) << after.status().message();
  EXPECT_GT(after->tick(), before->tick());
  // Those that the server has not looked at yet are few, and go.
  const std::filesystem::path descriptors = "/proc/" + std::to_string(server_->pid()) + "/fd";
  const auto deadline = std::chrono::steady_clock::now() + patience;
  std::ptrdiff_t open = 1'000;
  while (open > 60 && std::chrono::steady_clock::now() < deadline) {
    open = std::distance(std::filesystem::directory_iterator(descriptors), {});
    ASSERT_TRUE(client.ping().ok());
  }
  EXPECT_LE(open, 60);
}

TEST_F(Abuse, TheSameSceneTwiceIsAWorldEach) {
  start({"--scene", "bouncing-ball", "--scene", "bouncing-ball"});
  client::Client client = connect();
  const auto worlds = client.list_worlds();
  ASSERT_TRUE(worlds.ok());
  ASSERT_EQ(worlds->worlds_size(), 2);
  EXPECT_EQ(worlds->worlds(0).name(), "bouncing-ball");
  EXPECT_EQ(worlds->worlds(1).name(), "bouncing-ball-2");
}

}  // namespace
}  // namespace pneuma::integration
