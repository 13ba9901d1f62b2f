// Shows what scripts build on: plain frames that are the state of their tick, worlds that go with the connection that
// made them, and a server that answers a script on its machine as fast as it asks.
#include <cstdint>
#include <cstring>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "raw_connection.h"
#include "served.h"
#include "support/temporary_folder.h"

namespace pneuma::integration {
namespace {

class Scripts : public Served {
 protected:
  static v1::CreateWorld owned(const std::string& name, bool paused = true) {
    v1::CreateWorld request;
    request.set_name(name);
    *request.mutable_scene() = two_balls();
    request.set_paused(paused);
    request.set_owned(true);
    return request;
  }
  static std::vector<std::string> names(client::Client& client) {
    const auto list = client.list_worlds();
    EXPECT_TRUE(list.ok());
    std::vector<std::string> names;
    for (const auto& world : list->worlds()) names.push_back(world.name());
    return names;
  }
};

TEST_F(Scripts, APlainFrameIsTheStateOfItsTick) {
  start();
  RawConnection connection(server_->tcp_address());
  ASSERT_TRUE(connection.say_hello());
  v1::ClientMessage message;
  message.set_request_id(2);
  *message.mutable_create_world() = owned("w");
  ASSERT_TRUE(connection.send(message));
  ASSERT_TRUE(connection.receive_reply(2));
  message.set_request_id(3);
  message.mutable_subscribe()->set_world("w");
  message.mutable_subscribe()->set_encoding(v1::Subscribe::PLAIN);
  message.mutable_subscribe()->set_velocities(true);
  ASSERT_TRUE(connection.send(message));
  ASSERT_TRUE(connection.receive_reply(3)->has_subscribed());
  message.set_request_id(4);
  message.mutable_step()->set_world("w");
  message.mutable_step()->set_ticks(30);
  message.mutable_step()->mutable_observe()->set_velocities(true);
  ASSERT_TRUE(connection.send(message));
  v1::Frame last;
  v1::State state;
  while (state.tick() == 0 || last.tick() != state.tick()) {
    const auto received = connection.receive();
    ASSERT_TRUE(received);
    if (received->has_frame()) last = received->frame();
    if (received->request_id() == 4) state = received->done().state();
  }
  ASSERT_EQ(state.tick(), 30U);
  ASSERT_EQ(state.soft_bodies_size(), 2);
  EXPECT_EQ(last.payload(), state.soft_bodies(0).positions() + state.soft_bodies(1).positions());
  EXPECT_EQ(last.velocities(), state.soft_bodies(0).velocities() + state.soft_bodies(1).velocities());
  EXPECT_EQ(last.payload().size(), 2U * 162U * 12U);
}

TEST_F(Scripts, RaysAreAnsweredOfTheTickThatTheWorldIsAt) {
  start();
  RawConnection connection(server_->tcp_address());
  ASSERT_TRUE(connection.say_hello());
  v1::ClientMessage message;
  *message.mutable_create_world() = owned("w");
  ASSERT_TRUE(connection.ask(2, message));
  message.mutable_step()->set_world("w");
  message.mutable_step()->set_ticks(3);
  ASSERT_TRUE(connection.ask(3, message));
  message.mutable_get_stats()->set_world("w");
  const auto stats = connection.ask(4, message);
  ASSERT_TRUE(stats);
  const v1::Stats::Body& ball = stats->stats().soft_bodies(0);
  message.mutable_raycast()->set_world("w");
  v1::Raycast::Ray& ray = *message.mutable_raycast()->add_rays();
  *ray.mutable_origin() = ball.centre_of_mass();
  ray.mutable_direction()->set_x(1.0);
  const auto met = connection.ask(5, message);
  ASSERT_TRUE(met && met->has_surface_points());
  EXPECT_EQ(met->surface_points().world(), "w");
  EXPECT_EQ(met->surface_points().tick(), 3U);
  ASSERT_EQ(met->surface_points().points_size(), 1);
  EXPECT_EQ(met->surface_points().points(0).body(), ball.name());
  message.mutable_bodies_in_box()->set_world("w");
  *message.mutable_bodies_in_box()->mutable_low() = ball.centre_of_mass();
  *message.mutable_bodies_in_box()->mutable_high() = ball.centre_of_mass();
  const auto boxes = connection.ask(6, message);
  ASSERT_TRUE(boxes && boxes->body_boxes().boxes_size() == 1);
  EXPECT_EQ(boxes->body_boxes().boxes(0).body(), ball.name());
  message.mutable_nearest_point()->set_world("w");
  *message.mutable_nearest_point()->add_points() = ball.centre_of_mass();
  message.mutable_nearest_point()->add_bodies("nobody");
  EXPECT_EQ(connection.ask(7, message)->error().where(), "nearest_point.bodies[0]");
}

TEST_F(Scripts, TouchesAreToldAsTheyBeginAndEnd) {
  start();
  RawConnection connection(server_->tcp_address());
  ASSERT_TRUE(connection.say_hello());
  v1::ClientMessage message;
  *message.mutable_create_world() = owned("w");
  ASSERT_TRUE(connection.ask(2, message));
  message.mutable_subscribe()->set_world("w");
  message.mutable_subscribe()->set_rate_hz(0.01);
  message.mutable_subscribe()->mutable_touches()->add_bodies("nobody");
  EXPECT_EQ(connection.ask(3, message)->error().where(), "subscribe.touches.bodies[0]");
  message.mutable_subscribe()->mutable_touches()->clear_bodies();
  const auto subscribed = connection.ask(4, message);
  ASSERT_TRUE(subscribed && subscribed->has_subscribed());
  message.set_request_id(5);
  message.mutable_step()->set_world("w");
  message.mutable_step()->set_ticks(600);
  ASSERT_TRUE(connection.send(message));
  std::set<std::pair<std::string, std::string>> touching;
  std::size_t told = 0;
  for (bool done = false; !done;) {
    const auto received = connection.receive();
    ASSERT_TRUE(received);
    done = received->request_id() == 5;
    if (!received->has_touches()) continue;
    EXPECT_EQ(received->touches().stream_id(), subscribed->subscribed().stream_id());
    for (const v1::Touches::Touch& touch : received->touches().touches()) {
      ++told;
      const std::pair pair(touch.first(), touch.second());
      if (touch.kind() == v1::Touches::Touch::BEGAN) {
        EXPECT_TRUE(touching.insert(pair).second);
      }
      if (touch.kind() == v1::Touches::Touch::ENDED) {
        EXPECT_EQ(touching.erase(pair), 1U);
      }
    }
  }
  EXPECT_GT(told, 0U);
}

TEST_F(Scripts, AnOwnedWorldEndsWithItsConnectionWhateverItDoes) {
  start({"--threads", "1"});
  client::Client watcher = connect();
  {
    client::Client owner = connect();
    ASSERT_TRUE(owner.create_world(owned("paused")).ok());
    v1::CreateWorld busy = owned("busy", false);
    *busy.mutable_scene() = endless();
    ASSERT_TRUE(owner.create_world(busy).ok());
    ASSERT_TRUE(owner.create_world(owned("running", false)).ok());
    create(owner, two_balls(), "kept", true);
    ASSERT_TRUE(watcher.subscribe("paused").ok());
    ASSERT_TRUE(watcher.subscribe("running").ok());
    EXPECT_EQ(names(watcher).size(), 4U);
  }
  ASSERT_TRUE(await_event(watcher, v1::Event::WORLD_DESTROYED));
  ASSERT_TRUE(await_event(watcher, v1::Event::WORLD_DESTROYED));
  // A tick of the busy one is cut short when it has taken a second.
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (names(watcher).size() > 1 && std::chrono::steady_clock::now() < deadline) {
    (void)watcher.next_update(std::chrono::milliseconds(20));
  }
  EXPECT_EQ(names(watcher), std::vector<std::string>{"kept"});
}

TEST_F(Scripts, AWorldOfTheSameNameThatSomebodyElseMadeStays) {
  start();
  client::Client other = connect();
  {
    client::Client owner = connect();
    ASSERT_TRUE(owner.create_world(owned("w")).ok());
    ASSERT_TRUE(owner.create_world(owned("last")).ok());
    ASSERT_TRUE(owner.destroy_world("w").ok());
    create(other, two_balls(), "w", true);
    ASSERT_TRUE(other.subscribe("last").ok());
  }
  ASSERT_TRUE(await_event(other, v1::Event::WORLD_DESTROYED)) << "the last one of those that the session ends";
  EXPECT_TRUE(other.stats("w").ok());
}

TEST_F(Scripts, NothingIsKeptOfAnOwnedWorld) {
  const support::TemporaryFolder folder;
  start({"--data-dir", folder / "data"});
  {
    client::Client owner = connect();
    ASSERT_TRUE(owner.create_world(owned("owned")).ok());
    create(owner, two_balls(), "kept", true);
    ASSERT_TRUE(owner.step("owned", 5).ok());
    EXPECT_EQ(owner.rewind_world("owned", 2).status().code(), base::StatusCode::failed_precondition);
    v1::BranchWorld branch;
    branch.set_world("kept");
    branch.set_name("branch");
    branch.set_owned(true);
    EXPECT_TRUE(owner.branch_world(branch).ok());
    const auto file = owner.snapshot("owned");
    ASSERT_TRUE(file.ok());
    v1::RestoreWorld restore;
    restore.set_name("copy");
    restore.set_snapshot(file->data());
    restore.set_owned(true);
    EXPECT_TRUE(owner.restore_world(restore).ok());
    EXPECT_EQ(names(owner).size(), 4U);
    server_->kill();
  }
  start({"--data-dir", folder / "data"});
  client::Client client = connect();
  EXPECT_EQ(names(client), std::vector<std::string>{"kept"});
}

TEST_F(Scripts, OnThisMachineRequestsAreNotCounted) {
  start();
  RawConnection connection(server_->tcp_address());
  ASSERT_TRUE(connection.say_hello());
  constexpr std::uint64_t requests = 1'000;
  ASSERT_TRUE(connection.send(RawConnection::lists(2, requests)));
  for (std::uint64_t id = 2; id < 2 + requests; ++id) {
    const auto reply = connection.receive();
    ASSERT_TRUE(reply);
    ASSERT_TRUE(reply->has_world_list());
  }
}

}  // namespace
}  // namespace pneuma::integration
