// Shows that what clients make the server hold in memory is bounded, for each and for all together, and given back:
// messages that do not end, replies that nobody reads, and a message that takes long to deal with.
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "faults/net_rig.h"

namespace pneuma::net {
namespace {

using namespace std::chrono_literals;

/// Waits for what the network thread is about to do; false where it does not within a minute.
template <class Condition>
bool eventually(const Condition& condition) {
  const auto deadline = std::chrono::steady_clock::now() + 60s;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(1ms);
  }
  return true;
}

bool is_goodbye_that_says(const std::optional<std::string>& message, const std::string& words) {
  return message && message->starts_with("goodbye ") && message->find(words) != std::string::npos;
}

/// Who said hello and reads nothing from then on, from so many hosts in turn.
std::vector<std::unique_ptr<RawClient>> deaf_clients(const EchoServer& server, std::size_t count,
                                                     std::uint8_t hosts = 1) {
  std::vector<std::unique_ptr<RawClient>> deaf;
  for (std::size_t i = 0; i < count; ++i) {
    const auto host = static_cast<std::uint8_t>(1 + i % hosts);
    deaf.push_back(std::make_unique<RawClient>(server.tcp_port(), 4'096, host));
    EXPECT_TRUE(say_hello(*deaf.back()));
  }
  return deaf;
}

TEST(NetMemory, MessagesThatDoNotEndAreBoundedTogether) {
  base::Limits limits = patient_limits();
  limits.received_bytes_max = 100'000;
  EchoServer server(limits);
  const std::string part = framed(std::string(60'000, 'x')).substr(0, 40'000);
  RawClient first(server.tcp_port());
  ASSERT_TRUE(say_hello(first));
  first.send_bytes(part);
  ASSERT_TRUE(eventually([&] { return server.server().memory().received >= 40'000; }));
  RawClient second(server.tcp_port());
  ASSERT_TRUE(say_hello(second));
  second.send_bytes(framed(std::string(64'000, 'y')));
  EXPECT_TRUE(is_goodbye_that_says(second.read_message(), "no room for more messages"));
  EXPECT_LE(server.server().memory().received, limits.received_bytes_max);

  first.send_bytes(framed(std::string(60'000, 'x')).substr(40'000));
  EXPECT_EQ(first.read_message().value_or("").size(), 60'000U);
  ASSERT_TRUE(eventually([&] { return server.server().memory().received == 0; }));
  RawClient third(server.tcp_port());
  ASSERT_TRUE(say_hello(third));
  third.send_message(std::string(64'000, 'z'));
  EXPECT_EQ(third.read_message().value_or("").size(), 64'000U);
}

TEST(NetMemory, AHeldSessionIsReadNoFurtherAndTheOthersAre) {
  EchoServer server(patient_limits());
  RawClient held(server.tcp_port());
  RawClient other(server.tcp_port());
  ASSERT_TRUE(say_hello(held));
  ASSERT_TRUE(say_hello(other));
  held.send_bytes(framed("hold").append(framed("after")));
  EXPECT_EQ(held.read_message(), "hold");
  for (int i = 0; i < 3; ++i) {
    other.send_message("meanwhile");
    EXPECT_EQ(other.read_message(), "meanwhile");
  }
  EXPECT_EQ(server.received(server.wait_opened(2).front()), 2) << "hello and hold";
  server.server().resume(server.wait_opened(2).front());
  EXPECT_EQ(held.read_message(), "after");
}

TEST(NetMemory, APausedSessionIsReadOnAfterThatTimeAndTheOthersAre) {
  EchoServer server(patient_limits());
  RawClient paused(server.tcp_port());
  RawClient other(server.tcp_port());
  ASSERT_TRUE(say_hello(paused));
  ASSERT_TRUE(say_hello(other));
  constexpr int pauses = 20;
  std::string messages;
  for (int i = 0; i < pauses; ++i) messages += framed("pause");
  const auto start = std::chrono::steady_clock::now();
  paused.send_bytes(messages.append(framed("after")));
  other.send_message("meanwhile");
  EXPECT_EQ(other.read_message(), "meanwhile");
  for (int i = 0; i < pauses; ++i) EXPECT_EQ(paused.read_message(), "pause");
  EXPECT_EQ(paused.read_message(), "after");
  EXPECT_GE(std::chrono::steady_clock::now() - start, pauses * pause_of_a_message);
}

TEST(NetMemory, AHeldSessionGoesWithItsConnection) {
  EchoServer server(patient_limits());
  RawClient held(server.tcp_port());
  ASSERT_TRUE(say_hello(held));
  held.send_message("hold");
  EXPECT_EQ(held.read_message(), "hold");
  server.stop();
  EXPECT_EQ(server.wait_closed(1).size(), 1U);
}

// B2 of the list of attacks: 28 MiB each, where the limit said 8.
TEST(NetMemory, RepliesThatNobodyReadsHoldUpTheirOwnQuestions) {
  EchoServer server(patient_limits());
  std::string questions;
  for (int i = 0; i < 100'000; ++i) questions += framed("?");
  std::vector<std::unique_ptr<RawClient>> deaf;
  std::vector<std::thread> senders;
  for (int i = 0; i < 4; ++i) {
    deaf.push_back(std::make_unique<RawClient>(server.tcp_port(), 4'096));
    ASSERT_TRUE(say_hello(*deaf.back()));
    senders.emplace_back([&questions, client = deaf.back().get()] { client->send_bytes(questions); });
  }
  RawClient bystander(server.tcp_port());
  ASSERT_TRUE(say_hello(bystander));
  std::size_t most = 0;
  for (int i = 0; i < 2'000; ++i) {
    ASSERT_TRUE(bystander.send_message("still here"));
    ASSERT_EQ(bystander.read_message(), "still here");
    most = std::max(most, server.server().memory().queued);
  }
  // Each takes 256 KiB of replies, and those to the questions that were read along with the last one.
  EXPECT_LT(most, 4U * 1024 * 1024);
  for (auto& client : deaf) {
    std::size_t answers = 0;
    while (answers < 100'000 && client->read_message() == "?") ++answers;
    EXPECT_EQ(answers, 100'000U) << "late, but all of them";
  }
  for (std::thread& sender : senders) sender.join();
  deaf.clear();
  EXPECT_TRUE(eventually([&] { return server.server().memory().queued == 0; }));
}

TEST(NetMemory, PastTheLimitForAllQueuesTheLongestIsClosed) {
  base::Limits limits = patient_limits();
  limits.queued_bytes_max = 400'000;
  EchoServer server(limits);
  RawClient deaf(server.tcp_port(), 4'096);
  ASSERT_TRUE(say_hello(deaf));
  const SessionId deaf_session = server.wait_opened(1).front();
  RawClient modest(server.tcp_port(), 4'096);
  ASSERT_TRUE(say_hello(modest));
  const SessionId modest_session = server.wait_opened(2).back();
  const auto reply = [] { return std::make_shared<const std::string>(50'000, 'x'); };
  server.server().send(modest_session, reply());
  // More than the sockets and the queues take, of one who reads nothing.
  for (int i = 0; i < 200; ++i) server.server().send(deaf_session, reply());
  EXPECT_NE(server.wait_closed(1).front().message().find("no room for the replies"), std::string::npos);
  EXPECT_EQ(modest.read_message().value_or("").size(), 50'000U);
  EXPECT_TRUE(eventually([&] { return server.server().memory().queued == 0; }));
}

// Short of the limit for all, where each queue is within its own.
void replies_that_nobody_reads_leave_frames_their_room(std::size_t sessions, std::uint8_t hosts) {
  base::Limits limits = patient_limits();
  limits.queued_bytes_max = 2'000'000;
  EchoServer server(limits);
  const auto deaf = deaf_clients(server, sessions, hosts);
  const std::vector<SessionId> opened = server.wait_opened(deaf.size());
  RawClient watcher(server.tcp_port());
  ASSERT_TRUE(say_hello(watcher));
  const SessionId watching = server.wait_opened(deaf.size() + 1).back();
  // More than the sockets take (some megabytes each), until frames find no room: were none closed, that is how it would
  // stay.
  for (std::size_t sent = 0; sent < 4'000 && server.server().memory().queued < limits.queued_bytes_max * 7 / 8;
       ++sent) {
    server.server().send(opened[sent % opened.size()], std::make_shared<const std::string>(50'000, 'x'));
    ASSERT_TRUE(watcher.send_message("still here"));  // what was sent has been queued when it is answered
    ASSERT_EQ(watcher.read_message(), "still here");
  }
  EXPECT_NE(server.wait_closed(1).front().message().find("no room for the replies"), std::string::npos);
  server.server().publish(
      std::make_shared<const std::vector<SessionId>>(1, watching),
      {.stream_id = 1, .tick = 1, .delta = nullptr, .key = std::make_shared<const std::string>("a frame")});
  EXPECT_EQ(watcher.read_message(), "a frame");
}

TEST(NetMemory, RepliesThatNobodyReadsLeaveFramesTheirRoom) {
  replies_that_nobody_reads_leave_frames_their_room(6, 1);
}

// Of twenty clients, none of which has much: a reply or two each, of them one being written.
TEST(NetMemory, RepliesThatManyClientsDoNotReadLeaveFramesTheirRoom) {
  replies_that_nobody_reads_leave_frames_their_room(20, 20);
}

TEST(NetMemory, PastTheLimitForAllQueuesFramesAreLeftOut) {
  base::Limits limits = patient_limits();
  limits.queued_bytes_max = 1'000'000;
  EchoServer server(limits);
  const auto deaf = deaf_clients(server, 8);
  // A stream each, so that nothing is shared.
  const std::vector<SessionId> opened = server.wait_opened(deaf.size());
  std::size_t most = 0;
  for (std::uint64_t tick = 1; tick <= 40; ++tick) {
    for (const SessionId session : opened) {
      server.server().publish(std::make_shared<const std::vector<SessionId>>(1, session),
                              {.stream_id = static_cast<std::uint32_t>(session),
                               .tick = tick,
                               .base_tick = tick - 1,
                               .delta = std::make_shared<const std::string>(100'000, 'd'),
                               .key = std::make_shared<const std::string>(100'000, 'k')});
    }
    RawClient bystander(server.tcp_port());  // what was published has been queued, or left out, when it is answered
    ASSERT_TRUE(say_hello(bystander));
    most = std::max(most, server.server().memory().queued);
  }
  EXPECT_LT(most, limits.queued_bytes_max + 100'000);
  EXPECT_GT(most, limits.queued_bytes_max / 2) << "the limit was come near to";
}

TEST(NetMemory, WhereFramesFillTheRoomNobodyIsClosedForAReply) {
  base::Limits limits = patient_limits();
  limits.queued_bytes_max = 1'000'000;
  EchoServer server(limits);
  const auto deaf = deaf_clients(server, 16);
  const std::vector<SessionId> opened = server.wait_opened(deaf.size());
  RawClient bystander(server.tcp_port());
  ASSERT_TRUE(say_hello(bystander));
  const std::string reply(60'000, 'r');  // more than frames leave free, and no large part of all
  std::size_t most = 0;
  for (std::uint64_t tick = 1; tick <= 40; ++tick) {
    for (const SessionId session : opened) {
      server.server().publish(std::make_shared<const std::vector<SessionId>>(1, session),
                              {.stream_id = static_cast<std::uint32_t>(session),
                               .tick = tick,
                               .base_tick = tick - 1,
                               .delta = std::make_shared<const std::string>(20'000, 'd'),
                               .key = std::make_shared<const std::string>(20'000, 'k')});
      ASSERT_TRUE(bystander.send_message(reply));
      ASSERT_EQ(bystander.read_message(), reply);
      most = std::max(most, server.server().memory().queued);
    }
  }
  EXPECT_GE(most + reply.size(), limits.queued_bytes_max * 7 / 8) << "frames find no room";
}

}  // namespace
}  // namespace pneuma::net
