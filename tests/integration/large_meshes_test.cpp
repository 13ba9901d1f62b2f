// Shows that a mesh of the largest size, written out, comes to a server in parts: by every client, in an edit too; that
// it is told to who asks for changes; and that it outlives the server. The mesh is a torus, which has a closed form of
// any even size.
#include <cmath>
#include <fstream>
#include <numbers>

#include <boost/asio.hpp>
#include <boost/beast.hpp>
#include <google/protobuf/util/json_util.h>

#include "base/limits.h"
#include "served.h"
#include "support/temporary_folder.h"

namespace pneuma::integration {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;

constexpr std::uint32_t around = 256;  // and as many about the tube
static_assert(std::size_t{around} * around == base::mesh_vertices_max);

v1::Mesh torus(const std::string& name) {
  v1::Mesh mesh;
  mesh.set_name(name);
  v1::Mesh::Triangles& triangles = *mesh.mutable_triangles();
  constexpr double turn = 2.0 * std::numbers::pi / around;
  for (std::uint32_t i = 0; i < around; ++i) {
    for (std::uint32_t j = 0; j < around; ++j) {
      const double from_axis_m = 2.0 + std::cos(turn * j);
      v1::Vec3& position = *triangles.add_positions();
      position.set_x(from_axis_m * std::cos(turn * i));
      position.set_y(from_axis_m * std::sin(turn * i));
      position.set_z(std::sin(turn * j));
      const auto vertex = [](std::uint32_t u, std::uint32_t v) { return u % around * around + v % around; };
      for (const std::uint32_t index : {vertex(i, j), vertex(i + 1, j), vertex(i, j + 1), vertex(i + 1, j),
                                        vertex(i + 1, j + 1), vertex(i, j + 1)}) {
        triangles.add_indices(index);
      }
    }
  }
  return mesh;
}

v1::SoftBody body_of(const std::string& mesh) {
  v1::SoftBody body;
  body.set_name("of " + mesh);
  body.set_mesh(mesh);
  body.mutable_springs()->set_stiffness_n_m(1.0);
  body.mutable_gas()->set_moles(0.02);
  return body;
}

v1::Scene one_torus() {
  v1::Scene scene;
  scene.set_name("large");
  scene.mutable_stepping()->set_substeps(16);
  scene.mutable_stepping()->set_integrator(v1::Stepping::SYMPLECTIC_EULER);
  *scene.add_meshes() = torus("first");
  *scene.add_soft_bodies() = body_of("first");
  return scene;
}

v1::SceneEdit another_torus() {
  v1::SceneEdit edit;
  *edit.add_changes()->mutable_add_mesh() = torus("second");
  v1::SoftBody& body = *edit.add_changes()->mutable_add_soft_body();
  body = body_of("second");
  body.mutable_position()->set_x(10.0);
  return edit;
}

template <class Message>
std::string json(const Message& message) {
  std::string text;
  EXPECT_TRUE(google::protobuf::util::MessageToJsonString(message, &text).ok());
  EXPECT_GT(text.size(), base::Limits().message_bytes_max);
  return text;
}

class LargeMeshes : public Served {
 protected:
  static void expect_toruses(client::Client& client, const std::string& world, int count) {
    const auto stats = client.stats(world);
    ASSERT_TRUE(stats.ok()) << stats.status().message();
    ASSERT_EQ(stats->soft_bodies_size(), count);
    for (const auto& body : stats->soft_bodies()) {
      EXPECT_EQ(body.vertices(), base::mesh_vertices_max);
      constexpr double volume_m3 = 2.0 * std::numbers::pi * std::numbers::pi * 2.0;  // 2 pi^2 R r^2
      EXPECT_NEAR(body.volume_m3(), volume_m3, 1e-3 * volume_m3);
    }
  }
};

TEST_F(LargeMeshes, AreCreatedAndAddedAndToldAndKept) {
  const support::TemporaryFolder folder;
  const std::vector<std::string> arguments{"--data-dir", folder / "data"};
  start(arguments);
  std::uint64_t hash = 0;
  {
    client::Client client = connect();
    create(client, one_torus(), "w", true);
    client::Client watcher = connect();
    ASSERT_TRUE(watcher.subscribe("w", {.commands = true}).ok());
    const auto edited = client.edit("w", another_torus());
    ASSERT_TRUE(edited.ok()) << edited.status().message();
    expect_toruses(client, "w", 2);

    std::optional<v1::Applied> applied;
    while (!applied) {
      const auto update = watcher.next_update(patience);
      ASSERT_TRUE(update.ok() && *update);
      if (const auto* told = std::get_if<v1::Applied>(&**update)) applied = *told;
    }
    EXPECT_EQ(applied->command().edit().edit().SerializeAsString(), another_torus().SerializeAsString());
    hash = client.stats("w")->state_hash();
  }
  server_->kill();
  start(arguments);
  client::Client client = connect();
  EXPECT_EQ(client.stats("w")->state_hash(), hash);
  expect_toruses(client, "w", 2);
}

TEST_F(LargeMeshes, ComeAsFilesOfTheClientProgram) {
  start();
  const support::TemporaryFolder folder;
  std::ofstream(folder / "scene.json") << json(one_torus());
  std::ofstream(folder / "edit.json") << json(another_torus());
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"create", folder / "scene.json", "--name", "w", "--paused"},
        std::vector<std::string>{"edit", "w", folder / "edit.json"}}) {
    std::vector<std::string> all{"--server", server_->tcp_address()};
    all.insert(all.end(), command.begin(), command.end());
    const support::Finished finished = support::run_program("pneuma", all);
    EXPECT_EQ(finished.exit_status, 0) << finished.error_output;
  }
  client::Client client = connect();
  expect_toruses(client, "w", 2);
}

TEST_F(LargeMeshes, ComeOverAWebSocket) {
  start();
  const std::string& address = server_->http_address();
  const auto colon = address.rfind(':');
  asio::io_context io;
  beast::websocket::stream<asio::ip::tcp::socket> socket(io);
  socket.next_layer().connect({asio::ip::make_address(address.substr(0, colon)),
                               static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1)))});
  socket.handshake("localhost", "/ws");
  socket.binary(true);
  const auto receive = [&] {
    beast::flat_buffer buffer;
    socket.read(buffer);
    v1::ServerMessage message;
    EXPECT_TRUE(message.ParseFromArray(buffer.data().data(), static_cast<int>(buffer.size())));
    return message;
  };
  v1::ClientMessage hello;
  hello.set_request_id(1);
  hello.mutable_hello()->set_protocol_version(base::protocol_version);
  socket.write(asio::buffer(hello.SerializeAsString()));
  ASSERT_TRUE(receive().has_welcome());

  v1::ClientMessage request;
  request.set_request_id(2);
  request.mutable_create_world()->set_name("w");
  request.mutable_create_world()->set_paused(true);
  *request.mutable_create_world()->mutable_scene() = one_torus();
  const std::string whole = request.SerializeAsString();
  constexpr std::size_t part_bytes = 500'000;
  for (std::size_t begin = 0; begin < whole.size(); begin += part_bytes) {
    v1::ClientMessage part;
    part.set_request_id(2);
    part.mutable_part()->set_data(whole.substr(begin, part_bytes));
    part.mutable_part()->set_last(begin + part_bytes >= whole.size());
    socket.write(asio::buffer(part.SerializeAsString()));
  }
  const v1::ServerMessage reply = receive();
  EXPECT_EQ(reply.request_id(), 2U);
  EXPECT_EQ(reply.done().world(), "w") << reply.error().what();
  client::Client client = connect();
  expect_toruses(client, "w", 1);
}

}  // namespace
}  // namespace pneuma::integration
