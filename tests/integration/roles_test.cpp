// Shows what each role may do: every kind of request, by every role and by none, over TCP and WebSocket; and what is
// read over HTTP. A server with two worlds, of which the tokens name one.
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <google/protobuf/descriptor.h>

#include "app/request_kinds.h"
#include "app/token_file.h"
#include "raw_connection.h"
#include "served.h"
#include "support/temporary_folder.h"
#include "web_socket.h"

namespace pneuma::integration {
namespace {

using app::Role;

constexpr const char* own_world = "lab-1";
constexpr const char* other_world = "office";
const std::array all_roles{Role::none, Role::view, Role::edit, Role::admin};

/// A connection of either kind.
class Peer {
 public:
  virtual ~Peer() = default;
  virtual void send(const v1::ClientMessage& message) = 0;
  virtual v1::ServerMessage receive() = 0;
  /// What answers it: frames of what was subscribed to may come before.
  v1::ServerMessage ask(const v1::ClientMessage& message) {
    send(message);
    for (;;) {
      v1::ServerMessage answer = receive();
      if (answer.request_id() != 0 || answer.has_goodbye() || testing::Test::HasFailure()) return answer;
    }
  }
};

class TcpPeer final : public Peer {
 public:
  explicit TcpPeer(const support::ServerProcess& server) : raw_(server.tcp_address()) {}
  void send(const v1::ClientMessage& message) override { ASSERT_TRUE(raw_.send(message)); }
  v1::ServerMessage receive() override {
    auto message = raw_.receive();
    EXPECT_TRUE(message);
    return message.value_or(v1::ServerMessage());
  }

 private:
  RawConnection raw_;
};

class WebPeer final : public Peer {
 public:
  explicit WebPeer(const support::ServerProcess& server) : socket_(io_, endpoint_of(server.http_address())) {}
  void send(const v1::ClientMessage& message) override { socket_.send(message); }
  v1::ServerMessage receive() override { return socket_.receive(); }

 private:
  boost::asio::io_context io_;
  WebSocket socket_;
};

v1::ClientMessage hello_with(const std::string& token) {
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_hello()->set_protocol_version(1);
  message.mutable_hello()->set_token(token);
  return message;
}

const google::protobuf::OneofDescriptor& request_kinds() {
  return *v1::ClientMessage::descriptor()->FindOneofByName("request");
}

bool names_a_world(const google::protobuf::FieldDescriptor& kind) {
  return kind.message_type()->FindFieldByName("world") != nullptr;
}

/// As empty as can be, but for the world.
v1::ClientMessage request_of(const google::protobuf::FieldDescriptor& kind, const std::string& world) {
  v1::ClientMessage message;
  message.set_request_id(7);
  auto* request = message.GetReflection()->MutableMessage(&message, &kind);
  if (const auto* field = kind.message_type()->FindFieldByName("world")) {
    request->GetReflection()->SetString(request, field, world);
  }
  return message;
}

class Roles : public Served {
 protected:
  void SetUp() override {
    for (const Role role : all_roles) {
      if (role != Role::none) tokens_.push_back(token(role, "lab-*"));
    }
    everywhere_ = token(Role::admin, "*");
    start({"--tokens", file_, "--commands-per-s", "1e6", "--commands-burst", "1e6"});
    client::ConnectOptions options;
    options.token = everywhere_;
    client::Client client = connect(options);
    for (const char* world : {own_world, other_world}) create(client, two_balls(), world, true);
  }

  std::string token(Role role, const std::string& worlds) {
    app::Grant grant;
    grant.role = role;
    grant.worlds = *app::WorldPattern::parse(worlds);
    const auto made = app::add_token(file_, grant);
    EXPECT_TRUE(made.ok()) << made.status().message();
    return made->secret;
  }
  [[nodiscard]] const std::string& token_of(Role role) const { return tokens_.at(static_cast<std::size_t>(role) - 1); }

  [[nodiscard]] std::unique_ptr<Peer> open(bool web) const {
    if (web) return std::make_unique<WebPeer>(*server_);
    return std::make_unique<TcpPeer>(*server_);
  }

  [[nodiscard]] std::string page(const std::string& path, const std::string& header = {}) const {
    RawConnection connection(server_->http_address());
    EXPECT_TRUE(connection.send("GET " + path + " HTTP/1.0\r\nHost: localhost\r\n" + header + "\r\n"));
    return connection.receive_to_end();
  }

 private:
  support::TemporaryFolder folder_;

 protected:
  const std::string file_ = folder_ / "tokens";
  std::vector<std::string> tokens_;  // by role
  std::string everywhere_;           // an admin's
};

TEST_F(Roles, EveryRequestIsAnsweredToItsRolesAndRefusedToOthers) {
  for (const bool web : {false, true}) {
    for (const Role role : {Role::view, Role::edit, Role::admin}) {
      const auto peer = open(web);
      const v1::ServerMessage welcome = peer->ask(hello_with(token_of(role)));
      EXPECT_EQ(welcome.welcome().role(), app::to_wire(role));
      EXPECT_EQ(welcome.welcome().worlds(), "lab-*");
      for (int i = 0; i < request_kinds().field_count(); ++i) {
        const auto& kind = *request_kinds().field(i);
        SCOPED_TRACE(std::string(web ? "WebSocket" : "TCP") + ", " + std::string(name_of(role)) + ", " + kind.name());
        if (kind.number() == v1::ClientMessage::kPong) continue;  // has no reply
        // Admins keep the world for the kinds that follow.
        const bool destroys = kind.number() == v1::ClientMessage::kDestroyWorld;
        const auto reply = peer->ask(request_of(kind, destroys ? "lab-none" : own_world));
        EXPECT_EQ(reply.request_id(), 7U);
        const bool may = role >= app::role_for(static_cast<v1::ClientMessage::RequestCase>(kind.number()));
        EXPECT_EQ(reply.error().code() != v1::Error::PERMISSION_DENIED, may) << reply.ShortDebugString();
        EXPECT_NE(reply.error().code(), v1::Error::UNAUTHENTICATED);
      }
    }
  }
}

TEST_F(Roles, WorldsOfOthersAreOutOfReachAndNobodyLearnsWhichThereAre) {
  for (const bool web : {false, true}) {
    const auto peer = open(web);
    ASSERT_TRUE(peer->ask(hello_with(token_of(Role::admin))).has_welcome());
    for (int i = 0; i < request_kinds().field_count(); ++i) {
      const auto& kind = *request_kinds().field(i);
      if (!names_a_world(kind)) continue;
      v1::ServerMessage there = peer->ask(request_of(kind, other_world));
      EXPECT_EQ(there.error().code(), v1::Error::PERMISSION_DENIED) << kind.name();
      EXPECT_EQ(there.error().where(), kind.name() + ".world");
      const v1::ServerMessage nowhere = peer->ask(request_of(kind, "nowhere"));
      EXPECT_EQ(there.SerializeAsString(), nowhere.SerializeAsString()) << kind.name();
    }
    v1::ClientMessage list;
    list.set_request_id(8);
    list.mutable_list_worlds();
    const auto worlds = peer->ask(list).world_list();
    ASSERT_EQ(worlds.worlds_size(), 1);
    EXPECT_EQ(worlds.worlds(0).name(), own_world);
  }
}

// What waits for a world that ends is answered with its name: a stranger's request for a stream is not to wait there.
TEST_F(Roles, AStreamOfAWorldOutOfReachIsNoStream) {
  client::ConnectOptions options;
  options.token = everywhere_;
  client::Client owner = connect(options);
  create(owner, endless(), "secret", true);
  const auto stream = owner.subscribe("secret");
  ASSERT_TRUE(stream.ok());
  ASSERT_TRUE(owner.resume("secret").ok());
  TcpPeer stranger(*server_);
  ASSERT_TRUE(stranger.ask(hello_with(token_of(Role::admin))).has_welcome());
  v1::ClientMessage message;
  message.set_request_id(5);
  message.mutable_request_key()->set_stream_id(stream->stream_id());
  stranger.send(message);
  ASSERT_TRUE(owner.destroy_world("secret").ok());
  const v1::ServerMessage answer = stranger.receive();
  EXPECT_EQ(answer.error().code(), v1::Error::NOT_FOUND);
  EXPECT_EQ(answer.error().what(), "this session has no stream " + std::to_string(stream->stream_id()));
}

TEST_F(Roles, ANewWorldGetsANameThatTheTokenIsFor) {
  TcpPeer peer(*server_);
  ASSERT_TRUE(peer.ask(hello_with(token_of(Role::admin))).has_welcome());
  v1::ClientMessage create;
  create.set_request_id(8);
  create.mutable_create_world()->set_builtin("bouncing-ball");
  EXPECT_EQ(peer.ask(create).error().code(), v1::Error::PERMISSION_DENIED) << "its name is the scene's";
  create.mutable_create_world()->set_name(other_world);
  EXPECT_EQ(peer.ask(create).error().code(), v1::Error::PERMISSION_DENIED) << "whether it is taken or not";
  create.mutable_create_world()->set_name("lab-2");
  EXPECT_EQ(peer.ask(create).done().world(), "lab-2");
}

TEST_F(Roles, WhatComesInPartsAsksForTheRoleOfTheWhole) {
  TcpPeer peer(*server_);
  ASSERT_TRUE(peer.ask(hello_with(token_of(Role::view))).has_welcome());
  v1::ClientMessage edit;
  edit.set_request_id(9);
  edit.mutable_edit()->set_world(own_world);
  v1::ClientMessage part;
  part.set_request_id(9);
  part.mutable_part()->set_data(edit.SerializeAsString());
  part.mutable_part()->set_last(true);
  EXPECT_EQ(peer.ask(part).error().code(), v1::Error::PERMISSION_DENIED);
}

TEST_F(Roles, WithoutATokenNotAByteOfAWorldIsTold) {
  const auto tells = [](const std::string& bytes) {
    return bytes.find(own_world) != std::string::npos || bytes.find(other_world) != std::string::npos ||
           bytes.find("two-balls") != std::string::npos;
  };
  for (int i = 0; i < request_kinds().field_count(); ++i) {
    const auto& kind = *request_kinds().field(i);
    RawConnection raw(server_->tcp_address());
    ASSERT_TRUE(raw.send(kind.number() == v1::ClientMessage::kHello ? hello_with("") : request_of(kind, own_world)));
    const std::string bytes = raw.receive_to_end();
    EXPECT_FALSE(tells(bytes)) << kind.name() << ": " << bytes;
    const auto web = open(true);
    const auto answer =
        web->ask(kind.number() == v1::ClientMessage::kHello ? hello_with("") : request_of(kind, own_world));
    const auto code = answer.has_error() ? answer.error().code() : answer.goodbye().reason().code();
    EXPECT_EQ(code, v1::Error::UNAUTHENTICATED) << kind.name();
    EXPECT_FALSE(tells(answer.SerializeAsString())) << kind.name();
  }
  for (const char* path : {"/", "/worlds", "/metrics", "/healthz", "/ws", "/lab-1"}) {
    EXPECT_FALSE(tells(page(path))) << path;
  }
  EXPECT_TRUE(page("/worlds").starts_with("HTTP/1.0 401 ")) << page("/worlds");
  EXPECT_NE(page("/worlds").find("WWW-Authenticate: Bearer\r\n"), std::string::npos);
  EXPECT_TRUE(page("/healthz").starts_with("HTTP/1.0 200 "));
  EXPECT_NE(page("/metrics").find("\npneuma_worlds 2\n"), std::string::npos);
  for (const char* wrong : {"Authorization: Bearer wrong\r\n", "Authorization: Basic bGFi\r\n"}) {
    EXPECT_TRUE(page("/worlds", wrong).starts_with("HTTP/1.0 401 "));
    EXPECT_TRUE(page("/metrics", wrong).starts_with("HTTP/1.0 401 "));
    EXPECT_TRUE(page("/healthz", wrong).starts_with("HTTP/1.0 200 ")) << "it is asked by who has no token";
  }
}

TEST_F(Roles, OverHttpATokenShowsItsWorlds) {
  const std::string worlds = page("/worlds", "Authorization: Bearer " + token_of(Role::view) + "\r\n");
  EXPECT_TRUE(worlds.starts_with("HTTP/1.0 200 ")) << worlds;
  EXPECT_NE(worlds.find("1 world\nlab-1 "), std::string::npos) << worlds;
  EXPECT_EQ(worlds.find(other_world), std::string::npos) << worlds;
}

}  // namespace
}  // namespace pneuma::integration
