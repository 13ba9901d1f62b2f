// Shows that no client makes a real server hold much memory, by messages that are small on the wire alone and by
// replies that it does not read, and that the system gets it back.
#include <chrono>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "base/limits.h"
#include "raw_connection.h"
#include "served.h"
#include "support/process_memory.h"
#include "support/sanitizers.h"

namespace pneuma::integration {
namespace {

constexpr std::size_t mebibyte = 1024 * 1024;

class Memory : public Served {
 protected:
  [[nodiscard]] std::size_t resident() const { return support::memory_bytes(server_->pid(), "VmRSS:").value(); }
  [[nodiscard]] std::size_t peak() const { return support::memory_bytes(server_->pid(), "VmHWM:").value(); }
};

// A scene of 520,000 empty soft bodies: a megabyte on the wire, a quarter of a gigabyte once it is parsed.
TEST_F(Memory, AMessageOfEmptyFieldsIsRefusedUnparsed) {
  start();
  v1::ClientMessage message;
  message.set_request_id(7);
  v1::Scene& scene = *message.mutable_create_world()->mutable_scene();
  for (int i = 0; i < 520'000; ++i) scene.add_soft_bodies();
  RawConnection attacker(server_->tcp_address());
  ASSERT_TRUE(attacker.say_hello());
  const std::size_t before = peak();
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(attacker.send(message));
    const auto reply = attacker.receive_reply(7);
    ASSERT_TRUE(reply) << "the connection goes on";
    EXPECT_EQ(reply->error().code(), v1::Error::LIMIT_EXCEEDED) << reply->error().what();
  }
  if (!support::is_sanitized) {
    EXPECT_LT(peak(), before + 16 * mebibyte);
  }
}

// The largest message that is taken whole, refused for something else: it is parsed, and its memory given back.
TEST_F(Memory, WhatLargeMessagesTookIsGivenBack) {
  start({"--commands-per-s", "1000", "--commands-burst", "1000"});
  v1::ClientMessage message;
  message.set_request_id(7);
  v1::Mesh::Triangles& triangles =
      *message.mutable_edit()->mutable_edit()->add_changes()->mutable_add_mesh()->mutable_triangles();
  for (int i = 0; i < 30'000; ++i) *triangles.add_positions() = vec(1.0, 2.0, 3.0);
  message.mutable_edit()->set_world("nowhere");
  std::vector<std::unique_ptr<RawConnection>> connections;
  const std::size_t before = resident();
  for (int i = 0; i < 16; ++i) {
    connections.push_back(std::make_unique<RawConnection>(server_->tcp_address()));
    ASSERT_TRUE(connections.back()->say_hello());
    ASSERT_TRUE(connections.back()->send(message));
  }
  for (auto& connection : connections) {
    const auto reply = connection->receive_reply(7);
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->error().code(), v1::Error::NOT_FOUND);
  }
  if (support::is_sanitized) return;
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (resident() > before + 8 * mebibyte && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_LE(resident(), before + 8 * mebibyte);
}

// 31 connections that ping and never read took 855 MiB, and the server kept them.
TEST_F(Memory, RepliesThatNobodyReadsTakeLittleAndAreGivenBack) {
  start();
  client::Client bystander = connect();
  std::string pings;
  for (std::uint64_t id = 2; id < 20'000; ++id) {
    v1::ClientMessage ping;
    ping.set_request_id(id);
    ping.mutable_ping();
    pings += RawConnection::envelope(ping.SerializeAsString());
  }
  const std::size_t before = resident();
  {
    std::vector<std::unique_ptr<RawConnection>> deaf;
    std::vector<std::thread> senders;
    for (int i = 0; i < 16; ++i) {
      deaf.push_back(std::make_unique<RawConnection>(server_->tcp_address(), 4'096));
      ASSERT_TRUE(deaf.back()->say_hello());
      senders.emplace_back(
          [&pings, connection = deaf.back().get()] { (void)connection->send_for(pings, patience / 60); });
    }
    for (std::thread& sender : senders) sender.join();
    ASSERT_TRUE(bystander.ping().ok());
  }
  if (support::is_sanitized) return;
  EXPECT_LT(peak(), before + 32 * mebibyte);
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (resident() > before + 8 * mebibyte && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_LE(resident(), before + 8 * mebibyte);
}

/// A ball of 40,962 vertices: some 340 bytes of request.
v1::Scene large_ball(v1::Stepping::Integrator integrator) {
  v1::Scene scene = two_balls("large");
  scene.mutable_soft_bodies()->DeleteSubrange(1, 1);
  scene.clear_rigid_bodies();
  scene.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(6);
  scene.mutable_stepping()->set_integrator(integrator);
  scene.mutable_stepping()->set_substeps(1);
  scene.mutable_stepping()->set_on_unstable(v1::Stepping::ALLOW);
  return scene;
}

TEST_F(Memory, WorldsBeyondTheServersMemoryAreRefusedWithTheNumberAndTheOthersGoOn) {
  constexpr std::size_t server_bytes = 512 * mebibyte;
  start({"--memory-bytes-max", "512MiB", "--client-memory-bytes-max", "512MiB", "--world-memory-bytes-max", "512MiB"});
  client::Client client = connect();
  create(client, two_balls(), "light");
  v1::CreateWorld request;
  *request.mutable_scene() = large_ball(v1::Stepping::IMPLICIT_EULER);
  int made = 0;
  std::optional<base::Status> refused;
  for (; made < 20 && !refused; ++made) {
    request.set_name("large-" + std::to_string(made));
    if (const auto done = client.create_world(request); !done.ok()) refused = done.status();
  }
  ASSERT_TRUE(refused) << "20 worlds of 195 MiB found room in 256";
  EXPECT_GT(made, 1) << refused->message();
  EXPECT_EQ(refused->code(), base::StatusCode::unavailable);
  EXPECT_EQ(refused->where(), "create_world.scene");
  EXPECT_NE(refused->what().find(" MiB are left of the server's"), std::string::npos) << refused->message();
  // The refused one has left nothing behind, and those that are there run.
  const auto light = client.stats("light");
  ASSERT_TRUE(light.ok());
  ASSERT_TRUE(client.subscribe("light").ok());
  EXPECT_TRUE(await_frame(client, [&](const auto& frame) { return frame.tick > light->tick() + 10; }));
  EXPECT_TRUE(client.step("large-0", 1).status().code() == base::StatusCode::failed_precondition) << "it runs";
  if (!support::is_sanitized) {
    EXPECT_LT(peak(), server_bytes);
  }
  ASSERT_TRUE(client.destroy_world("large-0").ok());
  EXPECT_TRUE(client.create_world(request).ok()) << "there is room again";
}

TEST_F(Memory, AClientsWorldsAndOneWorldHaveTheirOwnLimits) {
  start({"--memory-bytes-max", "2GiB", "--client-memory-bytes-max", "300MiB", "--world-memory-bytes-max", "210MiB"});
  client::Client client = connect();
  create(client, large_ball(v1::Stepping::IMPLICIT_EULER), "first", true);
  v1::CreateWorld second;
  second.set_name("second");
  second.set_paused(true);
  *second.mutable_scene() = large_ball(v1::Stepping::IMPLICIT_EULER);
  const auto refused = client.create_world(second);
  EXPECT_EQ(refused.status().code(), base::StatusCode::limit_exceeded);
  EXPECT_NE(refused.status().what().find("are left of what you may take"), std::string::npos)
      << refused.status().message();

  // An edit that makes the world too large changes nothing.
  v1::SceneEdit edit;
  v1::SoftBody& another = *edit.add_changes()->mutable_add_soft_body();
  another = large_ball(v1::Stepping::IMPLICIT_EULER).soft_bodies(0);
  another.set_name("another");
  const auto edited = client.edit("first", edit);
  EXPECT_EQ(edited.status().code(), base::StatusCode::limit_exceeded);
  EXPECT_NE(edited.status().what().find("a world may take 210 MiB"), std::string::npos) << edited.status().message();
  EXPECT_EQ(client.stats("first")->soft_bodies_size(), 1);

  // Nor do streams go past it: 20 MiB each.
  std::optional<base::Status> stream_refused;
  for (int i = 1; i <= 8 && !stream_refused; ++i) {
    client::SubscribeOptions options;
    options.max_error_m = 1e-3 * i;
    options.velocities = true;
    const auto subscribed = client.subscribe("first", options);
    if (!subscribed.ok()) stream_refused = subscribed.status();
  }
  ASSERT_TRUE(stream_refused);
  EXPECT_EQ(stream_refused->where(), "subscribe");
  EXPECT_NE(stream_refused->what().find("a world may take 210 MiB"), std::string::npos) << stream_refused->message();
}

}  // namespace
}  // namespace pneuma::integration
