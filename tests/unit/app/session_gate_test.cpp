// Shows what a session may say and when: hello first, its version and token, request ids, rate. Bytes and times are
// made up.
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
  SessionGate gate(7, "", limits, no_parts());
  EXPECT_TRUE(say(gate, hello(1), start).authenticated);
  return gate;
}

TEST(SessionGate, HelloIsWelcomed) {
  SessionGate gate(7, "", {}, no_parts());
  const auto verdict = say(gate, hello(1), start);
  EXPECT_TRUE(verdict.authenticated);
  EXPECT_FALSE(verdict.close);
  ASSERT_TRUE(verdict.reply);
  EXPECT_EQ(verdict.reply->request_id(), 1U);
  EXPECT_EQ(verdict.reply->welcome().session_id(), 7U);
  EXPECT_EQ(verdict.reply->welcome().message_bytes_max(), base::Limits().message_bytes_max);
}

TEST(SessionGate, AnythingBeforeHelloCloses) {
  SessionGate gate(7, "", {}, no_parts());
  const auto verdict = say(gate, list_worlds(1), start);
  ASSERT_TRUE(verdict.close);
  EXPECT_EQ(verdict.close->code(), base::StatusCode::unauthenticated);
  EXPECT_FALSE(verdict.request);
}

TEST(SessionGate, BytesThatAreNoMessageClose) {
  for (const bool after_hello : {false, true}) {
    SessionGate gate = after_hello ? opened() : SessionGate(7, "", {}, no_parts());
    const auto verdict = say(gate, "\xff\xff\xff garbage", start);
    ASSERT_TRUE(verdict.close);
    EXPECT_EQ(verdict.close->code(), base::StatusCode::malformed);
  }
}

TEST(SessionGate, AnotherVersionIsRefusedAndClosed) {
  SessionGate gate(7, "", {}, no_parts());
  const auto verdict = say(gate, hello(2), start);
  EXPECT_FALSE(verdict.authenticated);
  ASSERT_TRUE(verdict.reply);
  EXPECT_EQ(verdict.reply->error().code(), v1::Error::UNSUPPORTED);
  EXPECT_EQ(verdict.reply->error().where(), "hello.protocol_version");
  EXPECT_TRUE(verdict.close);
}

TEST(SessionGate, OnlyTheTokenOpens) {
  for (const std::string wrong : {"", "secre", "secret2", "Secret"}) {
    SessionGate gate(7, "secret", {}, no_parts());
    const auto verdict = say(gate, hello(1, wrong), start);
    EXPECT_FALSE(verdict.authenticated) << wrong;
    EXPECT_EQ(verdict.reply->error().code(), v1::Error::UNAUTHENTICATED);
    EXPECT_EQ(verdict.reply->error().what(),
              wrong.empty() ? "is missing: this server asks for a token" : "is not this server's");
    EXPECT_TRUE(verdict.close);
  }
  SessionGate gate(7, "secret", {}, no_parts());
  EXPECT_TRUE(say(gate, hello(1, "secret"), start).authenticated);
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
  EXPECT_TRUE(say(gate, list_worlds(5), start + std::chrono::milliseconds(101)).request);
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

}  // namespace
}  // namespace pneuma::app
