// Shows how the client asks, against a server of one connection that follows a script: replies and errors, time-outs,
// requests in parts, and the server's pings in between.
#include <gtest/gtest.h>

#include "pneuma_client/client.h"
#include "unit/client/connected.h"
#include "unit/client/fake_server.h"

namespace pneuma::client {
namespace {

TEST(ClientCall, ReplyIsTheOneWithTheRequestsId) {
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    const auto request = session.receive();
    v1::ServerMessage other;
    other.set_request_id(request->request_id() + 1000);
    other.mutable_done()->set_tick(1);
    session.send(other);
    other.set_request_id(request->request_id());
    other.mutable_done()->set_tick(2);
    session.send(other);
  });
  Client client = connected(server);
  const auto done = client.pause("w");
  ASSERT_TRUE(done.ok()) << done.status().message();
  EXPECT_EQ(done->tick(), 2U);
}

TEST(ClientCall, ErrorReplyIsAStatusAndTheConnectionGoesOn) {
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    session.reply([](const auto&, auto& message) {
      message.mutable_error()->set_code(v1::Error::LIMIT_EXCEEDED);
      message.mutable_error()->set_what("1,024 worlds");
      message.mutable_error()->set_where("create_world");
      message.mutable_error()->set_retry_after_s(1.5);
    });
    session.reply([](const auto&, auto& message) { message.mutable_world_list()->add_worlds()->set_name("w"); });
  });
  Client client = connected(server);
  const auto done = client.create_builtin("five-balls");
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.status().code(), base::StatusCode::limit_exceeded);
  EXPECT_EQ(done.status().message(), "create_world: 1,024 worlds (try again in 2 s)");
  const auto worlds = client.list_worlds();
  ASSERT_TRUE(worlds.ok());
  EXPECT_EQ(worlds->worlds(0).name(), "w");
}

TEST(ClientCall, ReplyOfAnotherKindIsAnError) {
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    session.reply([](const auto&, auto& message) { message.mutable_world_list(); });
  });
  Client client = connected(server);
  EXPECT_EQ(client.pause("w").status().code(), base::StatusCode::malformed);
}

TEST(ClientCall, LateReplyToACallGivenUpOnIsIgnored) {
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    const auto first = session.receive();
    const auto second = session.receive();
    for (const auto& request : {first, second}) {
      v1::ServerMessage message;
      message.set_request_id(request->request_id());
      message.mutable_done()->set_tick(request->request_id());
      session.send(message);
    }
  });
  ConnectOptions options;
  Client client = connected(server, options);
  v1::ClientMessage request;
  request.mutable_pause()->set_world("w");
  EXPECT_EQ(client.call(request, soon).status().what(), "no reply in time");
  const auto done = client.resume("w");
  ASSERT_TRUE(done.ok()) << done.status().message();
  EXPECT_EQ(done->tick(), 3U);  // the third request of the connection
}

TEST(ClientCall, RequestLargerThanTheServerTakesIsNotSent) {
  const FakeServer server([](FakeSession& session) {
    session.welcome(1000);
    session.reply([](const auto& request, auto& message) {
      EXPECT_TRUE(request.has_pause());
      message.mutable_done();
    });
  });
  Client client = connected(server);
  EXPECT_EQ(client.edit_json("w", std::string(1000, ' ')).status().code(), base::StatusCode::limit_exceeded);
  EXPECT_TRUE(client.pause("w").ok());
}

TEST(ClientCall, RequestLargerThanTheServerTakesAtOnceGoesInParts) {
  const std::string text(2'500, 'x');
  const FakeServer server([&](FakeSession& session) {
    session.welcome(1'000, 4'000);
    std::string whole;
    bool is_last = false;
    std::uint64_t id = 0;
    while (!is_last) {
      const auto message = session.receive();
      ASSERT_TRUE(message && message->has_part());
      EXPECT_LE(message->ByteSizeLong(), 1'000U);
      id = message->request_id();
      whole += message->part().data();
      is_last = message->part().last();
    }
    v1::ClientMessage request;
    EXPECT_TRUE(request.ParseFromString(whole));
    EXPECT_EQ(request.request_id(), id);
    EXPECT_EQ(request.edit().edit_json(), text);
    v1::ServerMessage reply;
    reply.set_request_id(id);
    reply.mutable_done()->set_tick(4);
    session.send(reply);
  });
  Client client = connected(server);
  const auto done = client.edit_json("w", text);
  ASSERT_TRUE(done.ok()) << done.status().message();
  EXPECT_EQ(done->tick(), 4U);
  EXPECT_EQ(client.edit_json("w", text + text).status().code(), base::StatusCode::limit_exceeded);
}

// More than a socket's buffers hold, so that most parts leave after the ping has come.
TEST(ClientCall, ServersPingIsAnsweredBetweenTheParts) {
  constexpr std::uint32_t part_bytes = 1 << 20;
  constexpr std::uint32_t whole_bytes = 48 * part_bytes;
  bool was_answered = false;
  const FakeServer server([&](FakeSession& session) {
    session.welcome(part_bytes, whole_bytes);
    auto message = session.receive();
    const std::uint64_t id = message->request_id();
    v1::ServerMessage ping;
    ping.mutable_ping()->set_nonce(42);
    session.send(ping);
    while (message && !message->part().last()) {
      was_answered = was_answered || message->pong().nonce() == 42;
      message = session.receive();
    }
    v1::ServerMessage reply;
    reply.set_request_id(id);
    reply.mutable_done();
    session.send(reply);
    session.drain();
  });
  Client client = connected(server);
  EXPECT_TRUE(client.edit_json("w", std::string(whole_bytes - part_bytes, 'x')).ok());
  EXPECT_TRUE(was_answered);
}

TEST(ClientCall, AnErrorBetweenThePartsIsTheReply) {
  const FakeServer server([](FakeSession& session) {
    session.welcome(1'000, 4'000);
    auto message = session.receive();
    v1::ServerMessage refused;
    refused.set_request_id(message->request_id());
    refused.mutable_error()->set_code(v1::Error::UNAVAILABLE);
    refused.mutable_error()->set_what("no room");
    session.send(refused);
    while (message && !message->part().last()) message = session.receive();
    session.reply([](const auto&, auto& reply) { reply.mutable_done(); });
  });
  Client client = connected(server);
  EXPECT_EQ(client.edit_json("w", std::string(2'500, 'x')).status().what(), "no room");
  EXPECT_TRUE(client.pause("w").ok());
}

TEST(ClientCall, ServersPingIsAnswered) {
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    const auto request = session.receive();
    v1::ServerMessage message;
    message.mutable_ping()->set_nonce(42);
    session.send(message);
    const auto pong = session.receive();
    EXPECT_EQ(pong->pong().nonce(), 42U);
    message.Clear();
    message.set_request_id(request->request_id());
    message.mutable_done();
    session.send(message);
  });
  Client client = connected(server);
  EXPECT_TRUE(client.pause("w").ok());
}

}  // namespace
}  // namespace pneuma::client
