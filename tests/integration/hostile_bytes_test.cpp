// Shows what happens to a stream that can no longer be trusted: a typed goodbye, then an end; and to nobody else.
#include "raw_connection.h"
#include "served.h"

namespace pneuma::integration {
namespace {

class HostileBytes : public Served {
 protected:
  void SetUp() override { start(); }
  void TearDown() override {
    client::Client other = connect();
    EXPECT_TRUE(other.ping().ok());
    EXPECT_TRUE(server_->is_running());
  }
};

// Limits so short that a bystander might miss them too, on a busy machine.
class TimeLimits : public Served {
 protected:
  void TearDown() override { EXPECT_TRUE(server_->is_running()); }
};

v1::ClientMessage list_worlds() {
  v1::ClientMessage message;
  message.set_request_id(2);
  message.mutable_list_worlds();
  return message;
}

TEST_F(HostileBytes, AMessageBeforeHelloIsUnauthenticated) {
  RawConnection raw(server_->tcp_address());
  ASSERT_TRUE(raw.send(list_worlds()));
  EXPECT_TRUE(raw.ends());
  EXPECT_EQ(raw.goodbye(), v1::Error::UNAUTHENTICATED);
}

TEST_F(HostileBytes, GarbageIsMalformed) {
  RawConnection before(server_->tcp_address());
  ASSERT_TRUE(before.send(RawConnection::envelope("\xff\xfe\xfd this is no protobuf")));
  EXPECT_TRUE(before.ends());
  EXPECT_EQ(before.goodbye(), v1::Error::MALFORMED);

  RawConnection after(server_->tcp_address());
  ASSERT_TRUE(after.say_hello());
  ASSERT_TRUE(after.send(RawConnection::envelope("\xff\xfe\xfd this is no protobuf")));
  EXPECT_TRUE(after.ends());
  EXPECT_EQ(after.goodbye(), v1::Error::MALFORMED);
}

TEST_F(HostileBytes, AnOversizedLengthIsRefusedBeforeItsBytesCome) {
  for (const bool hello : {false, true}) {
    RawConnection raw(server_->tcp_address());
    if (hello) {
      ASSERT_TRUE(raw.say_hello());
    }
    ASSERT_TRUE(raw.send(std::string("\x7f\xff\xff\xff", 4)));
    EXPECT_TRUE(raw.ends());
    EXPECT_NE(raw.goodbye(), v1::Error::CODE_UNSPECIFIED);
  }
}

TEST_F(HostileBytes, ABigMessageBeforeHelloIsRefused) {
  RawConnection raw(server_->tcp_address());
  v1::ClientMessage hello;
  hello.set_request_id(1);
  hello.mutable_hello()->set_protocol_version(1);
  hello.mutable_hello()->set_client_name(std::string(5000, 'x'));
  ASSERT_TRUE(raw.send(hello));
  EXPECT_TRUE(raw.ends());
}

TEST_F(HostileBytes, AnHttpRequestOnTheProtocolPortIsEnded) {
  RawConnection raw(server_->tcp_address());
  ASSERT_TRUE(raw.send(std::string_view("GET / HTTP/1.1\r\nHost: here\r\n\r\n")));
  EXPECT_TRUE(raw.ends());
}

TEST_F(HostileBytes, AWrongVersionIsToldAndEnded) {
  RawConnection raw(server_->tcp_address());
  v1::ClientMessage hello;
  hello.set_request_id(1);
  hello.mutable_hello()->set_protocol_version(99);
  ASSERT_TRUE(raw.send(hello));
  const auto reply = raw.receive_reply(1);
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->error().code(), v1::Error::UNSUPPORTED);
  EXPECT_TRUE(raw.ends());
}

TEST_F(TimeLimits, ATruncatedMessageThenSilenceIsEnded) {
  start({"--partial-message-timeout-ms", "200"});
  RawConnection raw(server_->tcp_address());
  ASSERT_TRUE(raw.say_hello());
  const std::string whole = RawConnection::envelope(list_worlds().SerializeAsString());
  ASSERT_TRUE(raw.send(std::string_view(whole).substr(0, whole.size() - 1)));
  EXPECT_TRUE(raw.ends());
}

TEST_F(TimeLimits, WhoSaysNoHelloIsEnded) {
  start({"--hello-timeout-ms", "200"});
  RawConnection raw(server_->tcp_address());
  EXPECT_TRUE(raw.ends());
}

TEST_F(TimeLimits, WhoAnswersNoPingIsEnded) {
  start({"--ping-interval-ms", "100"});
  RawConnection raw(server_->tcp_address());
  ASSERT_TRUE(raw.say_hello());
  EXPECT_TRUE(raw.ends());
}

}  // namespace
}  // namespace pneuma::integration
