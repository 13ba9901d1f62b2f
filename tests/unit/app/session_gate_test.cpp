// Shows what a session may say and when: hello first, its version and token, what that allows, request ids, rate. Bytes
// and times are made up.
#include "app/session_gate.h"

#include <string>

#include <gtest/gtest.h>

#include "unit/app/gate_requests.h"

namespace pneuma::app {
namespace {

MessageParts& no_parts() {
  static MessageParts parts{base::Limits()};
  return parts;
}

std::string hello(std::uint32_t version, const std::string& token = {}) {
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_hello()->set_protocol_version(version);
  message.mutable_hello()->set_token(token);
  return message.SerializeAsString();
}

SessionGate opened(const base::Limits& limits = {}) {
  SessionGate gate(7, "here", open_house(limits), limits, no_parts());
  EXPECT_TRUE(say(gate, hello(1), start).authenticated);
  return gate;
}

TEST(SessionGate, HelloIsWelcomed) {
  SessionGate gate(7, "here", open_house(), {}, no_parts());
  const auto verdict = say(gate, hello(1), start);
  EXPECT_TRUE(verdict.authenticated);
  EXPECT_FALSE(verdict.close);
  ASSERT_TRUE(verdict.reply);
  EXPECT_EQ(verdict.reply->request_id(), 1U);
  EXPECT_EQ(verdict.reply->welcome().session_id(), 7U);
  EXPECT_EQ(verdict.reply->welcome().message_bytes_max(), base::Limits().message_bytes_max);
}

TEST(SessionGate, AnythingBeforeHelloCloses) {
  SessionGate gate(7, "here", open_house(), {}, no_parts());
  const auto verdict = say(gate, list_worlds(1), start);
  ASSERT_TRUE(verdict.close);
  EXPECT_EQ(verdict.close->code(), base::StatusCode::unauthenticated);
  EXPECT_FALSE(verdict.request);
}

TEST(SessionGate, BytesThatAreNoMessageClose) {
  for (const bool after_hello : {false, true}) {
    SessionGate gate = after_hello ? opened() : SessionGate(7, "here", open_house(), {}, no_parts());
    const auto verdict = say(gate, "\xff\xff\xff garbage", start);
    ASSERT_TRUE(verdict.close);
    EXPECT_EQ(verdict.close->code(), base::StatusCode::malformed);
  }
}

TEST(SessionGate, AnotherVersionIsRefusedAndClosed) {
  SessionGate gate(7, "here", open_house(), {}, no_parts());
  const auto verdict = say(gate, hello(2), start);
  EXPECT_FALSE(verdict.authenticated);
  ASSERT_TRUE(verdict.reply);
  EXPECT_EQ(verdict.reply->error().code(), v1::Error::UNSUPPORTED);
  EXPECT_EQ(verdict.reply->error().where(), "hello.protocol_version");
  EXPECT_TRUE(verdict.close);
}

TEST(SessionGate, OnlyTheTokenOpens) {
  Gatekeeper gatekeeper;
  gatekeeper.use({Token{{"an-id", Role::edit, {}, {}}, digest_of("secret")}});
  for (const std::string wrong : {"", "secre", "secret2", "Secret"}) {
    SessionGate gate(7, "here", gatekeeper, {}, no_parts());
    const auto verdict = say(gate, hello(1, wrong), start);
    EXPECT_FALSE(verdict.authenticated) << wrong;
    EXPECT_EQ(verdict.reply->error().code(), v1::Error::UNAUTHENTICATED);
    EXPECT_EQ(verdict.reply->error().what(),
              wrong.empty() ? "is missing: this server asks for a token" : "is not this server's");
    EXPECT_TRUE(verdict.close);
  }
  SessionGate gate(7, "here", gatekeeper, {}, no_parts());
  const auto verdict = say(gate, hello(1, "secret"), start);
  EXPECT_TRUE(verdict.authenticated);
  EXPECT_EQ(verdict.reply->welcome().role(), v1::Welcome::EDIT);
  EXPECT_EQ(verdict.reply->welcome().worlds(), "*");
}

std::string edit_of(const std::string& world) {
  v1::ClientMessage message;
  message.set_request_id(5);
  message.mutable_edit()->set_world(world);
  return message.SerializeAsString();
}

TEST(SessionGate, WhatTheTokenDoesNotAllowIsRefusedAndTheSessionGoesOn) {
  Gatekeeper gatekeeper;
  gatekeeper.use({Token{{"a", Role::view, {}, {}}, digest_of("views")},
                  Token{{"b", Role::edit, *WorldPattern::parse("lab-*"), {}}, digest_of("edits")}});
  SessionGate views(7, "here", gatekeeper, {}, no_parts());
  ASSERT_TRUE(say(views, hello(1, "views"), start).authenticated);
  const auto denied = say(views, edit_of("lab-1"));
  EXPECT_EQ(denied.reply->error().code(), v1::Error::PERMISSION_DENIED);
  EXPECT_EQ(denied.reply->error().where(), "edit");
  EXPECT_FALSE(denied.request);
  EXPECT_FALSE(denied.close);
  // An edit that is no edit: its role alone rules it out, so nobody reads on.
  EXPECT_EQ(say(views, std::string("\x08\x05\x42\x02\xff\xff", 6)).reply->error().code(), v1::Error::PERMISSION_DENIED);

  SessionGate edits(8, "here", gatekeeper, {}, no_parts());
  ASSERT_TRUE(say(edits, hello(1, "edits"), start).authenticated);
  EXPECT_TRUE(say(edits, edit_of("lab-1")).request);
  const auto elsewhere = say(edits, edit_of("office"));
  EXPECT_EQ(elsewhere.reply->error().code(), v1::Error::PERMISSION_DENIED);
  EXPECT_EQ(elsewhere.reply->error().where(), "edit.world");
  EXPECT_FALSE(elsewhere.request);
}

TEST(SessionGate, ASecondHelloIsRefusedAndTheSessionGoesOn) {
  SessionGate gate = opened();
  const auto verdict = say(gate, hello(1), start);
  EXPECT_EQ(verdict.reply->error().code(), v1::Error::FAILED_PRECONDITION);
  EXPECT_FALSE(verdict.close);
  EXPECT_TRUE(say(gate, list_worlds(2), start).request);
}

TEST(SessionGate, RequestIdZeroIsRefused) {
  SessionGate gate = opened();
  const auto verdict = say(gate, list_worlds(0), start);
  EXPECT_EQ(verdict.reply->error().where(), "request_id");
  EXPECT_FALSE(verdict.request);
  EXPECT_FALSE(verdict.close);
}

TEST(SessionGate, ARequestOfANewerProtocolIsUnsupported) {
  SessionGate gate = opened();
  // Field 1000, length-delimited and empty, after request id 9.
  const auto verdict = say(gate, std::string("\x08\x09\xc2\x3e\x00", 5), start);
  ASSERT_TRUE(verdict.reply);
  EXPECT_EQ(verdict.reply->request_id(), 9U);
  EXPECT_EQ(verdict.reply->error().code(), v1::Error::UNSUPPORTED);
}

TEST(SessionGate, PastItsRateASessionIsToldWhenToComeBack) {
  base::Limits limits;
  limits.commands_per_s = 10.0;
  limits.commands_burst = 3.0;
  SessionGate gate = opened(limits);  // hello took one
  EXPECT_TRUE(say(gate, list_worlds(2), start).request);
  EXPECT_TRUE(say(gate, list_worlds(3), start).request);
  const auto verdict = say(gate, list_worlds(4), start);
  EXPECT_FALSE(verdict.request);
  EXPECT_FALSE(verdict.close);
  EXPECT_EQ(verdict.reply->request_id(), 4U);
  EXPECT_EQ(verdict.reply->error().code(), v1::Error::LIMIT_EXCEEDED);
  EXPECT_NEAR(verdict.reply->error().retry_after_s(), 0.1, 1e-9);
  EXPECT_TRUE(verdict.is_over_rate);
  EXPECT_TRUE(say(gate, list_worlds(5), start + std::chrono::milliseconds(101)).request);
}

TEST(SessionGate, TheConnectionsOfAClientShareItsRate) {
  base::Limits limits;
  limits.commands_per_s = 10.0;
  limits.commands_burst = 6.0;
  Gatekeeper& house = open_house(limits);
  SessionGate first(7, "here", house, limits, no_parts());
  SessionGate second(8, "here", house, limits, no_parts());
  SessionGate elsewhere(9, "there", house, limits, no_parts());
  for (SessionGate* gate : {&first, &second, &elsewhere}) ASSERT_TRUE(say(*gate, hello(1)).authenticated);
  int granted = 0;
  for (int i = 0; i < 10; ++i) granted += say(i % 2 == 0 ? first : second, list_worlds(2)).request ? 1 : 0;
  EXPECT_EQ(granted, 4) << "each hello took one";
  EXPECT_TRUE(say(elsewhere, list_worlds(2)).request) << "another address is another client";
  // Neither does it help to leave and come again.
  SessionGate again(10, "here", house, limits, no_parts());
  ASSERT_TRUE(say(again, hello(1)).authenticated);
  EXPECT_FALSE(say(again, list_worlds(2)).request);
}

TEST(SessionGate, PingIsAnsweredAndPongHandedOn) {
  SessionGate gate = opened();
  v1::ClientMessage ping;
  ping.set_request_id(5);
  ping.mutable_ping()->set_nonce(99);
  EXPECT_EQ(say(gate, ping.SerializeAsString(), start).reply->pong().nonce(), 99U);

  v1::ClientMessage pong;
  pong.mutable_pong()->set_nonce(42);
  const auto verdict = say(gate, pong.SerializeAsString(), start);
  EXPECT_EQ(verdict.pong_nonce, 42U);
  EXPECT_FALSE(verdict.reply);
}

TEST(SessionGate, OfPongsThatNobodyAskedForFewAreReadAtOnce) {
  const base::Limits limits;
  SessionGate gate = opened(limits);
  v1::ClientMessage pong;
  pong.mutable_pong()->set_nonce(42);
  int taken = 0;
  SessionGate::Verdict last;
  for (; taken < 1'000; ++taken) {
    last = say(gate, pong.SerializeAsString(), start);
    if (!last.pong_nonce) break;
  }
  EXPECT_LT(taken, 100);
  EXPECT_TRUE(last.is_over_rate);
  EXPECT_FALSE(last.reply) << "it is no command, so it is not refused";
  EXPECT_TRUE(say(gate, pong.SerializeAsString(), start + limits.ping_interval).pong_nonce);
}

}  // namespace
}  // namespace pneuma::app
