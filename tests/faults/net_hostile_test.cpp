// Shows that no client, whatever it sends or leaves unsent, harms the server or another client's session: each test
// misbehaves over a real socket, sees its own session end with the reason, and then checks that a bystander is still
// served.
#include <chrono>
#include <cstdio>
#include <random>
#include <string>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "faults/net_rig.h"
#include "support/sanitizers.h"

namespace pneuma::net {
namespace {

using base::StatusCode;
using namespace std::chrono_literals;
using namespace std::string_literals;

base::Limits impatient_limits() {
  base::Limits limits = patient_limits();
  limits.partial_message_timeout = 200ms;
  limits.write_stall_timeout = 200ms;
  return limits;
}

class HostileClient : public testing::Test {
 public:
  explicit HostileClient(const base::Limits& limits = patient_limits()) : server_(limits) {}

 protected:
  void SetUp() override { ASSERT_TRUE(say_hello(bystander_)); }
  void TearDown() override {
    EXPECT_TRUE(bystander_.send_message("still here"));
    EXPECT_EQ(bystander_.read_message(), "still here");
    server_.stop();
    EXPECT_EQ(server_.calls_out_of_order(), 0);
  }

  EchoServer server_;
  RawClient bystander_{server_.tcp_port()};
};

class SilentClient : public HostileClient {
 public:
  SilentClient() : HostileClient(impatient_limits()) {}
};

class SlowClient : public testing::Test {
 protected:
  EchoServer server_{patient_limits()};
};

bool is_goodbye(const std::optional<std::string>& message) {
  return message && message->starts_with("goodbye ");
}

TEST_F(HostileClient, GarbageIsAnsweredByAGoodbye) {
  RawClient client(server_.tcp_port());
  client.send_bytes("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_TRUE(is_goodbye(client.read_message()));
  EXPECT_EQ(client.read_message(), std::nullopt);
  EXPECT_EQ(server_.wait_closed(1).back().code(), StatusCode::malformed);
}

TEST_F(HostileClient, RandomBytesEndTheirOwnSessionOnly) {
  std::mt19937 random(3);
  for (std::size_t i = 1; i <= 30; ++i) {
    RawClient client(server_.tcp_port());
    std::string bytes(1 + random() % 5'000, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    bytes[0] = '\x7F';  // a length past any limit
    client.send_bytes(bytes);
    client.shut_down_sending();
    client.read_rest();
    server_.wait_closed(i);
  }
}

TEST_F(HostileClient, AnOversizedLengthEndsTheSessionBeforeItsMessageComes) {
  RawClient client(server_.tcp_port());
  client.send_bytes("\x40\x00\x00\x00"s);
  EXPECT_TRUE(is_goodbye(client.read_message()));
  EXPECT_EQ(server_.wait_closed(1).back().code(), StatusCode::malformed);
}

TEST_F(HostileClient, BeforeHelloOnlySmallMessagesAreTaken) {
  RawClient client(server_.tcp_port());
  client.send_message(std::string(base::message_bytes_max_before_hello + 1, 'x'));
  EXPECT_TRUE(is_goodbye(client.read_message()));
}

TEST_F(HostileClient, ALargeMessageMayFollowHelloInTheSameSegment) {
  RawClient client(server_.tcp_port());
  const std::string large(60'000, 'x');
  client.send_bytes(framed("hello").append(framed(large)));
  EXPECT_EQ(client.read_message(), "hello");
  EXPECT_EQ(client.read_message(), large);
}

TEST_F(HostileClient, AnEmptyMessageIsMalformed) {
  RawClient client(server_.tcp_port());
  ASSERT_TRUE(say_hello(client));
  client.send_bytes("\0\0\0\0"s);
  EXPECT_TRUE(is_goodbye(client.read_message()));
}

TEST_F(HostileClient, NothingIsReceivedAfterTheMessageThatEndsTheSession) {
  RawClient client(server_.tcp_port());
  client.send_bytes("\0\0\0\5hello\0\0\0\3end\0\0\0\4more"s);
  EXPECT_EQ(client.read_message(), "hello");
  EXPECT_EQ(client.read_message(), "goodbye as asked");
  EXPECT_EQ(client.read_message(), std::nullopt);
}

TEST_F(SilentClient, HalfAMessageThenSilence) {
  RawClient client(server_.tcp_port());
  ASSERT_TRUE(say_hello(client));
  client.send_bytes("\0\0\0\x09half"s);
  EXPECT_TRUE(is_goodbye(client.read_message()));
  EXPECT_EQ(server_.wait_closed(1).back().code(), StatusCode::unavailable);
}

TEST_F(HostileClient, HalfAMessageThenTheEnd) {
  RawClient client(server_.tcp_port());
  ASSERT_TRUE(say_hello(client));
  client.send_bytes("\0\0\0\x09half"s);
  client.shut_down_sending();
  EXPECT_TRUE(is_goodbye(client.read_message()));
  EXPECT_EQ(server_.wait_closed(1).back().code(), StatusCode::malformed);
}

TEST_F(HostileClient, AClientThatOnlyEndsItsSideStillGetsItsReplies) {
  RawClient client(server_.tcp_port());
  client.send_message("hello");
  client.send_message("last question");
  client.shut_down_sending();
  EXPECT_EQ(client.read_message(), "hello");
  EXPECT_EQ(client.read_message(), "last question");
  EXPECT_TRUE(server_.wait_closed(1).back().ok());
}

TEST_F(HostileClient, AReset) {
  RawClient client(server_.tcp_port());
  ASSERT_TRUE(say_hello(client));
  client.reset();
  server_.wait_closed(1);
}

TEST_F(HostileClient, AResetUnderAWrite) {
  RawClient client(server_.tcp_port(), 4'096);
  ASSERT_TRUE(say_hello(client));
  for (int i = 0; i < 40; ++i) client.send_message(std::string(20'000, 'x'));
  client.reset();
  server_.wait_closed(1);
}

TEST_F(SilentClient, OneThatReadsNothingIsCutOff) {
  RawClient client(server_.tcp_port(), 4'096);
  ASSERT_TRUE(say_hello(client));
  // Either its replies fill the queue or its socket stalls, whichever comes first.
  const std::string question(60'000, 'x');
  for (int i = 0; i < 1'000 && client.send_message(question); ++i) {
  }
  EXPECT_FALSE(server_.wait_closed(1).back().ok());
}

TEST_F(SlowClient, OneThatReadsAByteAtATimeGetsAllOfIt) {
  RawClient client(server_.tcp_port(), 4'096);
  ASSERT_TRUE(say_hello(client));
  const std::string question(50'000, 'x');
  client.send_message(question);
  std::string answer;
  for (std::size_t i = 0; i < 4 + question.size(); ++i) answer += client.read_bytes(1).value_or("");
  EXPECT_EQ(answer.substr(4), question);
}

TEST_F(HostileClient, WithoutFileDescriptorsOthersAreToldAndTheClientsGoOn) {
  // The sanitizer asks through a pipe whether it may read an object, and takes a process without descriptors for one
  // with a bad object.
  if (support::is_address_sanitized) GTEST_SKIP() << "the undefined-behaviour sanitizer needs descriptors itself";
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const int next_free = ::dup(0);
  ::close(next_free);
  rlimit tight = before;
  tight.rlim_cur =
      static_cast<rlim_t>(next_free) + 1;  // room for the client's end of a connection, none for the server's
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &tight), 0);
  {
    RawClient client(server_.tcp_port());
    const auto goodbye = client.read_message();
    ASSERT_TRUE(goodbye);
    EXPECT_EQ(*goodbye, "goodbye the server has no file descriptors left; try again later");
  }
  EXPECT_TRUE(bystander_.send_message("go on"));
  EXPECT_EQ(bystander_.read_message(), "go on");
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  RawClient client(server_.tcp_port());
  EXPECT_TRUE(client.send_message("hello"));
  EXPECT_EQ(client.read_message(), "hello");
}

TEST_F(SlowClient, ASlowReaderGetsFramesWithGapsAndKeysAndIsNotWaitedFor) {
  RawClient client(server_.tcp_port(), 4'096);
  ASSERT_TRUE(say_hello(client));
  const auto sessions = std::make_shared<const std::vector<SessionId>>(1, server_.wait_opened(1).back());
  const auto body = std::string(50'000, '.');
  // Far more than sockets and queue hold, published at once: the publisher is never held up.
  constexpr int frames = 400;
  for (int tick = 1; tick <= frames; ++tick) {
    const std::string name = std::to_string(tick) + " " + body;
    server_.server().publish(sessions, {.stream_id = 1,
                                        .tick = static_cast<std::uint64_t>(tick),
                                        .base_tick = static_cast<std::uint64_t>(tick - 1),
                                        .delta = std::make_shared<const std::string>("delta " + name),
                                        .key = std::make_shared<const std::string>("key " + name)});
  }
  int last = 0;
  int missed = 0;
  while (last < frames) {
    const auto message = client.read_message();
    ASSERT_TRUE(message);
    int first = 0;
    int second = 0;
    if (message->starts_with("gap 1 ")) {
      ASSERT_EQ(std::sscanf(message->c_str(), "gap 1 %d %d", &first, &second), 2);
      EXPECT_EQ(first, last + 1);
      missed += second - first + 1;
      last = second;
    } else {
      const bool is_key = message->starts_with("key ");
      ASSERT_EQ(std::sscanf(message->c_str(), is_key ? "key %d" : "delta %d", &first), 1);
      if (last > 0) {
        EXPECT_EQ(first, last + 1);
      } else {
        missed +=
            first - 1;  // the key that it began with may have been replaced before it left: a joiner is told of no gap
      }
      last = first;
    }
  }
  EXPECT_GT(missed, 0);
  EXPECT_LT(missed, frames);
}

TEST(HostileClients, HelloThatNeverComes) {
  base::Limits limits = patient_limits();
  limits.hello_timeout = 500ms;
  EchoServer server(limits);
  RawClient silent(server.tcp_port());
  EXPECT_TRUE(is_goodbye(silent.read_message()));
  RawClient slow(server.tcp_port());
  for (const char byte : framed(std::string(100, 'x')).substr(0, 10)) slow.send_bytes({&byte, 1});
  EXPECT_TRUE(is_goodbye(slow.read_message()));
  EXPECT_EQ(server.wait_closed(2).size(), 2U);
}

TEST(HostileClients, TwoUnansweredPingsEndTheSession) {
  base::Limits limits = patient_limits();
  limits.ping_interval = 50ms;
  EchoServer server(limits);
  RawClient client(server.tcp_port());
  ASSERT_TRUE(say_hello(client));
  EXPECT_EQ(client.read_message(), "ping 1");
  EXPECT_EQ(client.read_message(), "ping 2");
  EXPECT_TRUE(is_goodbye(client.read_message()));
}

TEST(HostileClients, MoreConnectionsThanAllowedAreToldSo) {
  base::Limits limits = patient_limits();
  limits.connections_per_address_max = 3;
  EchoServer server(limits);
  RawClient first(server.tcp_port());
  RawClient second(server.tcp_port());
  ASSERT_TRUE(say_hello(first));
  ASSERT_TRUE(say_hello(second));
  {
    RawClient third(server.tcp_port());
    ASSERT_TRUE(say_hello(third));
    for (int i = 0; i < 5; ++i) {
      RawClient refused(server.tcp_port());
      refused.send_message("hello");
      const auto goodbye = refused.read_message();
      ASSERT_TRUE(is_goodbye(goodbye));
      EXPECT_NE(goodbye->find("again"), std::string::npos);
      EXPECT_EQ(refused.read_message(), std::nullopt);
    }
    RawClient page(server.http_port());
    page.send_bytes("GET /hello HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_TRUE(page.read_rest().starts_with("HTTP/1.1 503 "));
    ASSERT_TRUE(say_hello(third)) << "those who are in are not harmed";
  }
  server.wait_closed(1);
  // The place comes back with the connection's last bytes; until then we are told to try again, and do.
  bool let_in = false;
  for (int i = 0; i < 1'000 && !let_in; ++i) {
    RawClient again(server.tcp_port());
    let_in = say_hello(again);
  }
  EXPECT_TRUE(let_in);
}

TEST(HostileClients, StopSaysGoodbyeAndDoesNotWaitForTheDeaf) {
  EchoServer server(patient_limits());
  RawClient client(server.tcp_port());
  RawClient deaf(server.tcp_port(), 4'096);
  ASSERT_TRUE(say_hello(client));
  ASSERT_TRUE(say_hello(deaf));
  client.send_message("question");
  EXPECT_EQ(client.read_message(), "question");
  for (int i = 0; i < 10; ++i) deaf.send_message(std::string(50'000, 'x'));
  std::thread reader([&] {
    EXPECT_EQ(client.read_message(), "goodbye stopping");
    EXPECT_EQ(client.read_message(), std::nullopt);
  });
  server.stop();
  reader.join();
  EXPECT_EQ(server.calls_out_of_order(), 0);
}

}  // namespace
}  // namespace pneuma::net
