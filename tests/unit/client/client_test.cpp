// Shows the client against a server of one connection that follows a script: the hello, what comes unasked and its
// order, and every way in which a server can go away or speak nonsense.
#include "pneuma_client/client.h"

#include <optional>
#include <random>

#include <gtest/gtest.h>

#include "support/closed_port.h"
#include "unit/client/connected.h"
#include "unit/client/fake_server.h"

namespace pneuma::client {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

v1::ServerMessage event_message(std::uint64_t tick) {
  v1::ServerMessage message;
  message.mutable_event()->set_kind(v1::Event::WORLD_SLOWED);
  message.mutable_event()->set_tick(tick);
  return message;
}

v1::ServerMessage gap_message(std::uint32_t stream_id, std::uint64_t from, std::uint64_t to) {
  v1::ServerMessage message;
  message.mutable_gap()->set_stream_id(stream_id);
  message.mutable_gap()->set_from_tick(from);
  message.mutable_gap()->set_to_tick(to);
  return message;
}

void subscribe_to_ball(FakeSession& session) {
  session.welcome();
  session.reply([](const auto&, auto& message) { fill_subscribed(1, message); });
  session.send(topology_message());
  session.send(layout_message(1));
}

TEST(ClientConnect, SaysHelloAndIsWelcomed) {
  v1::Hello hello;
  {
    const FakeServer server([&](FakeSession& session) { hello = session.welcome(); });
    ConnectOptions options;
    options.token = "secret";
    options.client_name = "test";
    const Client client = connected(server, options);
    EXPECT_EQ(client.welcome().server_version(), "fake");
  }
  EXPECT_EQ(hello.protocol_version(), 1U);
  EXPECT_EQ(hello.token(), "secret");
  EXPECT_EQ(hello.client_name(), "test");
}

TEST(ClientConnect, RefusedConnectionNamesTheAddress) {
  const support::ClosedPort nobody;
  const auto client = Client::connect(nobody.address());
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.status().code(), base::StatusCode::unavailable);
  EXPECT_EQ(client.status().where(), nobody.address());
  EXPECT_NE(client.status().what().find("refused"), std::string::npos) << client.status().what();
}

TEST(ClientConnect, SilentServerIsGivenUp) {
  const FakeServer server([](FakeSession& session) { session.drain(); });
  ConnectOptions options;
  options.connect_timeout = seconds(1);  // enough to connect
  const auto client = Client::connect(server.address(), options);
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.status().message(), server.address() + ": no reply in time");
}

TEST(ClientConnect, WrongTokenIsToldAsSent) {
  const FakeServer server([](FakeSession& session) {
    session.reply([](const auto&, auto& message) {
      message.mutable_error()->set_code(v1::Error::UNAUTHENTICATED);
      message.mutable_error()->set_what("wrong token");
      message.mutable_error()->set_where("hello.token");
    });
  });
  const auto client = Client::connect(server.address());
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.status().code(), base::StatusCode::unauthenticated);
  EXPECT_EQ(client.status().message(), "hello.token: wrong token");
}

TEST(ClientConnect, AnotherProtocolIsNamed) {
  const std::string alert("\x15\x03\x01\x00\x02\x02\x46", 7);  // TLS: fatal, protocol version
  for (const auto& [bytes, name] : {std::pair{alert, "TLS"}, {std::string("HTTP/1.1 400 Bad Request\r\n"), "HTTP"}}) {
    const FakeServer server([&](FakeSession& session) {
      session.send_bytes(bytes);
      session.drain();
    });
    const auto status = Client::connect(server.address()).status();
    EXPECT_EQ(status.code(), base::StatusCode::malformed);
    EXPECT_NE(status.what().find(name), std::string::npos) << status.what();
  }
}

TEST(ClientConnect, ServerThatClosesWithoutAWordMaySpeakTls) {
  const FakeServer server([](FakeSession& session) { session.receive(); });
  const auto status = Client::connect(server.address()).status();
  EXPECT_EQ(status.code(), base::StatusCode::unavailable);
  EXPECT_NE(status.what().find("TLS"), std::string::npos) << status.what();
}

TEST(ClientConnect, AddressMustBeHostAndPort) {
  for (const char* address : {"", "localhost", ":7420", "localhost:", "::1:7420", "host:0", "host:65536", "host:12a"}) {
    EXPECT_EQ(Client::connect(address).status().code(), base::StatusCode::invalid_argument) << address;
  }
  std::string host;
  std::string port;
  EXPECT_TRUE(split_address("[::1]:7420", host, port));
  EXPECT_EQ(host, "::1");
  EXPECT_EQ(port, "7420");
}

TEST(ClientUpdates, WhatComesWhileACallWaitsIsKeptInOrder) {
  const FakeServer server([](FakeSession& session) {
    subscribe_to_ball(session);
    const auto request = session.receive();
    session.send(key_frame(1, 10));
    session.send(event_message(11));
    session.send(delta_frame(1, 12, 10, 5, 0));
    v1::ServerMessage done;
    done.set_request_id(request->request_id());
    done.mutable_done()->set_tick(12);
    session.send(done);
    session.drain();
  });
  Client client = connected(server);
  ASSERT_TRUE(client.subscribe("w").ok());
  ASSERT_TRUE(client.pause("w").ok());

  auto update = client.next_update(long_enough);
  ASSERT_TRUE(update.ok() && *update);
  EXPECT_EQ(std::get<DecodedFrame>(**update).tick, 10U);
  update = client.next_update(long_enough);
  EXPECT_EQ(std::get<v1::Event>(**update).tick(), 11U);
  update = client.next_update(long_enough);
  EXPECT_EQ(std::get<DecodedFrame>(**update).tick, 12U);
  update = client.next_update(soon);
  ASSERT_TRUE(update.ok());
  EXPECT_FALSE(update->has_value());
}

TEST(ClientUpdates, NextFramePassesOverEventsAndKeepsThem) {
  const FakeServer server([](FakeSession& session) {
    subscribe_to_ball(session);
    session.send(event_message(1));
    session.send(key_frame(1, 2));
    session.drain();
  });
  Client client = connected(server);
  ASSERT_TRUE(client.subscribe("w").ok());
  const auto frame = client.next_frame(long_enough);
  ASSERT_TRUE(frame.ok() && *frame);
  EXPECT_EQ((*frame)->tick, 2U);
  const auto event = client.next_event(milliseconds(0));
  ASSERT_TRUE(event.ok() && *event);
  EXPECT_EQ((*event)->tick(), 1U);
}

TEST(ClientUpdates, GapIsHandedOnAndCounted) {
  const FakeServer server([](FakeSession& session) {
    subscribe_to_ball(session);
    session.send(key_frame(1, 1));
    session.send(gap_message(1, 2, 9));
    session.send(key_frame(1, 10, 3));
    session.drain();
  });
  Client client = connected(server);
  ASSERT_TRUE(client.subscribe("w").ok());
  ASSERT_TRUE(*client.next_frame(long_enough));
  const auto update = client.next_update(long_enough);
  ASSERT_TRUE(update.ok() && *update);
  EXPECT_EQ(std::get<v1::Gap>(**update).to_tick(), 9U);
  EXPECT_EQ(client.gaps(), 1U);
  EXPECT_EQ(client.ticks_missed(), 8U);
  EXPECT_EQ((*client.next_frame(long_enough))->tick, 10U);
}

TEST(ClientUpdates, AFrameThatFailsItsCheckIsToldAndAKeyFrameIsAskedFor) {
  std::optional<v1::ClientMessage> asked;
  const FakeServer server([&](FakeSession& session) {
    subscribe_to_ball(session);
    session.send(key_frame(1, 1));
    auto wrong = delta_frame(1, 2, 1, 5, 0);
    wrong.mutable_frame()->set_check(1);
    session.send(wrong);
    session.send(delta_frame(1, 3, 2, 6, 5));
    asked = session.receive();
    v1::ServerMessage refused;  // of no concern to the client
    refused.set_request_id(asked->request_id());
    refused.mutable_error()->set_code(v1::Error::LIMIT_EXCEEDED);
    session.send(refused);
    session.send(delta_frame(1, 4, 3, 7, 6));
    session.send(key_frame(1, 5, 8));
    session.send(delta_frame(1, 6, 5, 9, 8));
    session.drain();
  });
  Client client = connected(server);
  ASSERT_TRUE(client.subscribe("w").ok());
  EXPECT_EQ((*client.next_frame(long_enough))->tick, 1U);
  const auto update = client.next_update(long_enough);
  ASSERT_TRUE(update.ok() && *update) << update.status().message();
  const auto& fault = std::get<StreamFault>(**update);
  EXPECT_EQ(fault.stream_id, 1U);
  EXPECT_EQ(fault.tick, 2U);
  EXPECT_NE(fault.status.message().find("stream 1: the vertices at tick 2 are not the server's"), std::string::npos)
      << fault.status.message();
  for (const std::uint64_t tick : {5U, 6U}) {
    const auto next = client.next_update(long_enough);
    ASSERT_TRUE(next.ok() && *next) << next.status().message();
    EXPECT_EQ(std::get<DecodedFrame>(**next).tick, tick) << "frames before the key frame do not come";
  }
  ASSERT_TRUE(asked && asked->has_request_key());
  EXPECT_EQ(asked->request_key().stream_id(), 1U);
}

TEST(ClientUpdates, TopologiesHeldAreNamedWhenSubscribing) {
  std::vector<TopologyPtr> held;
  {
    const FakeServer server([](FakeSession& session) {
      subscribe_to_ball(session);
      session.send(key_frame(1, 1));
      session.drain();
    });
    Client client = connected(server);
    ASSERT_TRUE(client.subscribe("w").ok());
    ASSERT_TRUE(*client.next_frame(long_enough));
    held = client.topologies();
  }
  ASSERT_EQ(held.size(), 1U);
  const FakeServer server([&](FakeSession& session) {
    session.welcome();
    session.reply([&](const auto& request, auto& message) {
      ASSERT_EQ(request.subscribe().known_topologies_size(), 1);
      EXPECT_EQ(request.subscribe().known_topologies(0), held[0]->hash);
      fill_subscribed(4, message);
    });
    session.send(layout_message(4));
    session.send(key_frame(4, 1));
    session.drain();
  });
  ConnectOptions options;
  options.topologies = held;
  Client client = connected(server, options);
  ASSERT_TRUE(client.subscribe("w").ok());
  const auto frame = client.next_frame(long_enough);
  ASSERT_TRUE(frame.ok() && *frame) << frame.status().message();
  EXPECT_EQ((*frame)->bodies[0].topology, held[0]);
}

TEST(ClientUpdates, FramesAfterUnsubscribeAreDropped) {
  const FakeServer server([](FakeSession& session) {
    subscribe_to_ball(session);
    session.reply([](const auto& request, auto& message) {
      EXPECT_EQ(request.unsubscribe().stream_id(), 1U);
      message.mutable_done();
    });
    session.send(key_frame(1, 5));
    session.send(event_message(6));
    session.drain();
  });
  Client client = connected(server);
  ASSERT_TRUE(client.subscribe("w").ok());
  ASSERT_TRUE(client.unsubscribe(1).ok());
  const auto update = client.next_update(long_enough);
  ASSERT_TRUE(update.ok() && *update);
  EXPECT_TRUE(std::holds_alternative<v1::Event>(**update));
}

// An adaptive stream that is replaced twice; its reader sees one stream.
TEST(ClientUpdates, AReplacedStreamGoesOnUnderItsFirstId) {
  std::uint32_t ended = 0;
  {
    const FakeServer server([&](FakeSession& session) {
      session.welcome();
      session.reply([](const auto&, auto& message) { fill_subscribed(1, message); });
      session.send(topology_message());
      for (std::uint32_t id = 1; id <= 3; ++id) {
        session.send(layout_message(id));
        session.send(key_frame(id, id));
        if (id == 3) break;
        v1::ServerMessage successor;
        fill_subscribed(id + 1, successor);
        v1::ServerMessage replaced;
        replaced.mutable_event()->set_kind(v1::Event::STREAM_REPLACED);
        replaced.mutable_event()->set_stream_id(id);
        *replaced.mutable_event()->mutable_successor() = successor.subscribed();
        session.send(replaced);
        session.send(key_frame(id, id));  // of the stream that has ended
      }
      session.reply([&](const auto& request, auto& message) {
        ended = request.unsubscribe().stream_id();
        message.mutable_done();
      });
      session.drain();
    });
    auto client = Client::connect(server.address());
    ASSERT_TRUE(client.ok());
    ASSERT_TRUE(client->subscribe("w", {.adaptive = true}).ok());
    for (std::uint64_t tick = 1; tick <= 3; ++tick) {
      const auto frame = client->next_frame(std::chrono::seconds(10));
      ASSERT_TRUE(frame.ok() && *frame);
      EXPECT_EQ((*frame)->tick, tick);
      EXPECT_EQ((*frame)->stream_id, 1U);
    }
    const auto event = client->next_event(std::chrono::seconds(10));
    ASSERT_TRUE(event.ok() && *event);
    EXPECT_EQ((*event)->successor().stream_id(), 2U);
    EXPECT_TRUE(client->unsubscribe(1).ok());
  }
  EXPECT_EQ(ended, 3U) << "by the id that the server knows";
}

TEST(ClientUpdates, OldestGoWhenNobodyTakesThem) {
  constexpr std::uint64_t extra = 10;
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    for (std::uint64_t tick = 0; tick < Client::updates_max + extra; ++tick) session.send(event_message(tick));
    session.reply([](const auto&, auto& message) { message.mutable_done(); });
  });
  Client client = connected(server);
  ASSERT_TRUE(client.pause("w").ok());
  EXPECT_EQ(client.updates_dropped(), extra);
  EXPECT_EQ((*client.next_event(milliseconds(0)))->tick(), extra);
}

TEST(ClientUpdates, MessageInSinglePiecesIsPutTogether) {
  const FakeServer server([](FakeSession& session) {
    session.welcome();
    for (const char byte : framed(event_message(77).SerializeAsString())) session.send_bytes(std::string(1, byte));
    session.drain();
  });
  Client client = connected(server);
  const auto event = client.next_event(long_enough);
  ASSERT_TRUE(event.ok() && *event);
  EXPECT_EQ((*event)->tick(), 77U);
}

/// What a client says when the server behaves as `script` after the welcome; it must say it again.
base::Status end_of(const FakeServer::Script& script) {
  const FakeServer server([&](FakeSession& session) {
    session.welcome();
    script(session);
  });
  Client client = connected(server);
  const auto update = client.next_update(long_enough);
  EXPECT_FALSE(update.ok());
  EXPECT_EQ(client.list_worlds().status().message(), update.status().message());
  return update.status();
}

TEST(ClientEnd, GoodbyeGivesItsReason) {
  const auto status = end_of([](FakeSession& session) {
    v1::ServerMessage message;
    message.mutable_goodbye()->mutable_reason()->set_code(v1::Error::UNAVAILABLE);
    message.mutable_goodbye()->mutable_reason()->set_what("going down");
    session.send(message);
  });
  EXPECT_EQ(status.code(), base::StatusCode::unavailable);
  EXPECT_EQ(status.message(), "the server said goodbye: going down");
}

TEST(ClientEnd, ClosedConnectionIsUnavailable) {
  const auto status = end_of([](FakeSession&) {});
  EXPECT_EQ(status.code(), base::StatusCode::unavailable);
  EXPECT_EQ(status.message(), "the server closed the connection");
}

TEST(ClientEnd, ClosedInTheMiddleOfAMessageIsUnavailable) {
  const auto status =
      end_of([](FakeSession& session) { session.send_bytes(framed(std::string(100, 'x')).substr(0, 50)); });
  EXPECT_EQ(status.code(), base::StatusCode::unavailable);
}

TEST(ClientEnd, LengthOfNoMessageIsMalformed) {
  for (const std::string& prefix : {std::string("\xff\xff\xff\xff"), std::string(4, '\0')}) {
    const auto status = end_of([&](FakeSession& session) {
      session.send_bytes(prefix);
      session.drain();
    });
    EXPECT_EQ(status.code(), base::StatusCode::malformed);
  }
}

TEST(ClientEnd, BytesThatAreNoMessageAreMalformed) {
  const auto status = end_of([](FakeSession& session) { session.send_bytes(framed("\xff\xff\xff")); });
  EXPECT_EQ(status.code(), base::StatusCode::malformed);
}

TEST(ClientEnd, FrameThatCannotBeDecodedIsMalformed) {
  const FakeServer server([](FakeSession& session) {
    subscribe_to_ball(session);
    auto frame = key_frame(1, 1);
    frame.mutable_frame()->set_payload("\x07");
    session.send(frame);
    session.drain();
  });
  Client client = connected(server);
  ASSERT_TRUE(client.subscribe("w").ok());
  const auto frame = client.next_frame(long_enough);
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.status().message(), "stream 1.payload: is of format 7, which is not known");
  EXPECT_FALSE(client.pause("w").ok());
}

TEST(ClientEnd, SpoiltMessagesNeverCrash) {
  std::mt19937 random(1);
  for (int round = 0; round < 60; ++round) {
    const FakeServer server([&](FakeSession& session) {
      subscribe_to_ball(session);
      for (const auto& message :
           {key_frame(1, 1), delta_frame(1, 2, 1, 4, 0), event_message(3), gap_message(1, 5, 4)}) {
        std::string bytes = message.SerializeAsString();
        bytes[random() % bytes.size()] = static_cast<char>(static_cast<unsigned char>(random()));
        session.send_bytes(framed(bytes));
      }
    });
    Client client = connected(server);
    ASSERT_TRUE(client.subscribe("w").ok());
    auto update = client.next_update(long_enough);
    while (update.ok() && *update) update = client.next_update(long_enough);
    EXPECT_FALSE(update.ok());
  }
}

}  // namespace
}  // namespace pneuma::client
