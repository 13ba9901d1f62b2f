// A real server and clients of it, for the tests of this folder. Everything is bounded in time.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pneuma_client/client.h"
#include "support/server_process.h"

namespace pneuma::integration {

inline constexpr std::chrono::seconds patience{60};

/// Two balls of 162 vertices under gravity over a floor.
inline v1::Scene two_balls(const std::string& name = "two-balls") {
  v1::Scene scene;
  scene.set_name(name);
  scene.mutable_gravity()->set_y(-9.81);
  scene.mutable_stepping()->set_substeps(8);
  v1::Mesh& mesh = *scene.add_meshes();
  mesh.set_name("sphere");
  mesh.mutable_icosphere()->set_subdivisions(2);
  for (const char* body : {"left", "right"}) {
    v1::SoftBody& ball = *scene.add_soft_bodies();
    ball.set_name(body);
    ball.set_mesh("sphere");
    ball.mutable_position()->set_x(*body == 'l' ? -2.0 : 2.0);
    ball.mutable_position()->set_y(3.0);
    ball.mutable_springs()->set_stiffness_n_m(300.0);
    ball.mutable_springs()->set_damping_n_s_m(0.5);
    ball.mutable_gas()->set_moles(0.02);
  }
  v1::Collider& floor = *scene.add_colliders();
  floor.set_name("floor");
  floor.mutable_shape()->mutable_plane();
  v1::RigidBody& stone = *scene.add_rigid_bodies();
  stone.set_name("stone");
  stone.mutable_shape()->mutable_sphere()->set_radius_m(0.5);
  stone.mutable_position()->set_y(0.5);
  return scene;
}

/// A tick of it takes hours.
inline v1::Scene endless() {
  v1::Scene scene = two_balls("endless");
  scene.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(6);
  scene.mutable_stepping()->set_substeps(4096);
  scene.mutable_stepping()->set_integrator(v1::Stepping::RK4);
  for (auto& body : *scene.mutable_soft_bodies()) {
    body.mutable_volume()->set_method(v1::Volume::MONTE_CARLO);
    body.mutable_volume()->set_resolution(65'536);
  }
  return scene;
}

/// Twelve vertices and one substep a tick, due every millisecond: whenever its thread is free, it ticks.
inline v1::Scene light_and_quick() {
  v1::Scene scene = two_balls("light-and-quick");
  scene.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(0);
  scene.mutable_stepping()->set_rate_hz(1000.0);
  scene.mutable_stepping()->set_substeps(1);
  return scene;
}

/// Without a server or a connection a test cannot go on: both throw, which fails it.
class Served : public testing::Test {
 protected:
  void start(const std::vector<std::string>& arguments = {}) {
    server_.reset();
    auto server = support::ServerProcess::start(arguments);
    if (!server.ok()) throw std::runtime_error(server.status().message());
    server_.emplace(std::move(*server));
  }

  [[nodiscard]] client::Client connect(client::ConnectOptions options = {}) const {
    options.connect_timeout = patience;
    options.reply_timeout = patience;
    auto connected = client::Client::connect(server_->tcp_address(), options);
    if (!connected.ok()) throw std::runtime_error(connected.status().message());
    return std::move(*connected);
  }

  static void create(client::Client& client, const v1::Scene& scene, const std::string& world, bool paused = false) {
    v1::CreateWorld request;
    request.set_name(world);
    *request.mutable_scene() = scene;
    request.set_paused(paused);
    const auto done = client.create_world(request);
    ASSERT_TRUE(done.ok()) << done.status().message();
    EXPECT_EQ(done->world(), world);
  }

  /// The next frame for which `wanted` holds; nothing where none comes in time.
  static std::optional<client::DecodedFrame> await_frame(
      client::Client& client,
      const std::function<bool(const client::DecodedFrame&)>& wanted = [](const auto&) { return true; }) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < deadline) {
      auto frame = client.next_frame(std::chrono::seconds(1));
      if (!frame.ok()) {
        ADD_FAILURE() << frame.status().message();
        return std::nullopt;
      }
      if (*frame && wanted(**frame)) return std::move(*frame);
    }
    return std::nullopt;
  }

  static std::optional<v1::Event> await_event(client::Client& client, v1::Event::Kind kind) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < deadline) {
      auto event = client.next_event(std::chrono::seconds(1));
      if (!event.ok()) {
        ADD_FAILURE() << event.status().message();
        return std::nullopt;
      }
      if (*event && (*event)->kind() == kind) return std::move(*event);
    }
    return std::nullopt;
  }

  static v1::Vec3 vec(double x, double y, double z) {
    v1::Vec3 out;
    out.set_x(x);
    out.set_y(y);
    out.set_z(z);
    return out;
  }

  std::optional<support::ServerProcess> server_;
};

}  // namespace pneuma::integration
