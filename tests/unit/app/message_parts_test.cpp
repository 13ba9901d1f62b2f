// Shows how a message becomes whole from its parts, and what each part is told that cannot be one: the gate of a
// session takes made-up bytes at made-up times.
#include "app/message_parts.h"

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <malloc.h>

#include "app/session_gate.h"
#include "unit/app/gate_requests.h"

namespace pneuma::app {
namespace {

constexpr std::uint64_t upload = 5;  // a request id

std::string edit(std::uint64_t request_id, std::size_t text_bytes) {
  v1::ClientMessage message;
  message.set_request_id(request_id);
  message.mutable_edit()->set_world("w");
  message.mutable_edit()->set_edit_json(std::string(text_bytes, 'x'));
  return message.SerializeAsString();
}

class Sender {
 public:
  explicit Sender(MessageParts& parts, std::uint64_t session_id = 7, const base::Limits& limits = {})
      : gate_(session_id, "here-" + std::to_string(session_id), open_house(limits), limits, parts) {
    v1::ClientMessage message;
    message.set_request_id(1);
    message.mutable_hello()->set_protocol_version(1);
    welcome_ = app::say(gate_, message.SerializeAsString()).reply->welcome();
  }

  [[nodiscard]] const v1::Welcome& welcome() const { return welcome_; }

  SessionGate::Verdict say(const std::string& bytes, SessionGate::TimePoint now = start) {
    return app::say(gate_, bytes, now);
  }
  SessionGate::Verdict part(std::uint64_t request_id, const std::string& data, bool last = false,
                            SessionGate::TimePoint now = start) {
    v1::ClientMessage message;
    message.set_request_id(request_id);
    message.mutable_part()->set_data(data);
    message.mutable_part()->set_last(last);
    return app::say(gate_, message.SerializeAsString(), now);
  }
  /// All parts but the last get no answer; gives what the last one gets.
  SessionGate::Verdict cut(std::uint64_t request_id, const std::string& message, std::size_t part_bytes) {
    for (std::size_t begin = 0; begin + part_bytes < message.size(); begin += part_bytes) {
      EXPECT_TRUE(is_silent(part(request_id, message.substr(begin, part_bytes))));
    }
    return part(request_id, message.substr((message.size() - 1) / part_bytes * part_bytes), true);
  }

  static bool is_silent(const SessionGate::Verdict& verdict) {
    return !verdict.reply && !verdict.request && !verdict.close && !verdict.pong_nonce;
  }

 private:
  SessionGate gate_;
  v1::Welcome welcome_;
};

void expect_refused(const SessionGate::Verdict& verdict, std::uint64_t request_id, v1::Error::Code code,
                    const std::string& where) {
  ASSERT_TRUE(verdict.reply);
  EXPECT_EQ(verdict.reply->request_id(), request_id);
  EXPECT_EQ(verdict.reply->error().code(), code) << verdict.reply->error().what();
  EXPECT_EQ(verdict.reply->error().where(), where);
  EXPECT_FALSE(verdict.request);
  EXPECT_FALSE(verdict.close);
}

constexpr std::uint64_t first_other_id = 101;

class Parts : public testing::Test {
 protected:
  /// Sessions that take all the room there is, each the most that one may have.
  std::vector<std::unique_ptr<Sender>> fill_room() {
    const std::string largest(base::parts_bytes_max, 'x');
    std::vector<std::unique_ptr<Sender>> senders;
    for (std::size_t held = 0; held < base::Limits().parts_waiting_bytes_max; held += largest.size()) {
      senders.push_back(std::make_unique<Sender>(parts_, first_other_id + senders.size()));
      EXPECT_TRUE(Sender::is_silent(senders.back()->part(upload, largest)));
    }
    return senders;
  }

  MessageParts parts_{base::Limits()};
  Sender sender_{parts_};
};

TEST_F(Parts, TheLargestMessagePassesAFreshGate) {
  EXPECT_EQ(sender_.welcome().parts_bytes_max(), base::parts_bytes_max);
  const std::string largest = edit(upload, base::parts_bytes_max - 64);
  const auto verdict = sender_.cut(upload, largest, base::Limits().message_bytes_max - 32);
  ASSERT_TRUE(verdict.request);
  EXPECT_EQ(verdict.request->message->SerializeAsString(), largest);
}

TEST_F(Parts, OtherRequestsGoBetweenThem) {
  const std::string whole = edit(upload, 100);
  EXPECT_TRUE(Sender::is_silent(sender_.part(upload, whole.substr(0, 50))));
  EXPECT_TRUE(sender_.say(list_worlds(6)).request);
  EXPECT_TRUE(sender_.part(upload, whole.substr(50), true).request);
}

TEST_F(Parts, ASecondMessageInPartsWaitsForTheFirst) {
  const std::string whole = edit(upload, 100);
  EXPECT_TRUE(Sender::is_silent(sender_.part(upload, whole.substr(0, 50))));
  expect_refused(sender_.part(6, "x"), 6, v1::Error::FAILED_PRECONDITION, "part");
  EXPECT_TRUE(Sender::is_silent(sender_.part(6, "x"))) << "a message is answered once";
  EXPECT_TRUE(sender_.part(upload, whole.substr(50), true).request);
}

TEST_F(Parts, EachMessageThatWaitsInVainIsAnsweredOnce) {
  const std::string whole = edit(upload, 100);
  EXPECT_TRUE(Sender::is_silent(sender_.part(upload, whole.substr(0, 50))));
  expect_refused(sender_.part(6, "x"), 6, v1::Error::FAILED_PRECONDITION, "part");
  expect_refused(sender_.part(7, "x"), 7, v1::Error::FAILED_PRECONDITION, "part");
  EXPECT_TRUE(Sender::is_silent(sender_.part(6, "x")));
  EXPECT_TRUE(sender_.part(upload, whole.substr(50), true).request);
  EXPECT_TRUE(Sender::is_silent(sender_.part(6, "x", true))) << "no beginning of another";
  EXPECT_TRUE(Sender::is_silent(sender_.part(7, "x", true)));
  EXPECT_TRUE(sender_.cut(8, edit(8, 100), 50).request);
}

TEST_F(Parts, AnEmptyPartIsRefused) {
  EXPECT_TRUE(Sender::is_silent(sender_.part(upload, "x")));
  expect_refused(sender_.part(upload, ""), upload, v1::Error::INVALID_ARGUMENT, "part.data");
  EXPECT_TRUE(Sender::is_silent(sender_.part(upload, "x", true)));
  EXPECT_TRUE(sender_.cut(6, edit(6, 100), 50).request);
}

TEST_F(Parts, WhatIsNoMessageIsRefusedAndTheSessionGoesOn) {
  expect_refused(sender_.cut(upload, "\xff\xff\xff garbage", 4), upload, v1::Error::INVALID_ARGUMENT, "part");
  expect_refused(sender_.cut(upload, edit(8, 100), 50), upload, v1::Error::INVALID_ARGUMENT, "request_id");
  v1::ClientMessage nested;
  nested.set_request_id(upload);
  nested.mutable_part()->set_data(edit(upload, 100));
  nested.mutable_part()->set_last(true);
  expect_refused(sender_.cut(upload, nested.SerializeAsString(), 50), upload, v1::Error::INVALID_ARGUMENT, "part");
  EXPECT_TRUE(sender_.cut(upload, edit(upload, 100), 50).request);
}

TEST_F(Parts, AHelloInPartsIsASecondOne) {
  v1::ClientMessage hello;
  hello.set_request_id(upload);
  hello.mutable_hello()->set_protocol_version(1);
  expect_refused(sender_.cut(upload, hello.SerializeAsString(), 2), upload, v1::Error::FAILED_PRECONDITION, "hello");
}

TEST_F(Parts, APongInPartsIsThePongThatItWouldBeWhole) {
  v1::ClientMessage pong;
  pong.set_request_id(upload);
  pong.mutable_pong()->set_nonce(42);
  const auto verdict = sender_.cut(upload, pong.SerializeAsString(), 2);
  EXPECT_EQ(verdict.pong_nonce, 42U);
  EXPECT_FALSE(verdict.request);
  EXPECT_FALSE(verdict.reply);
}

TEST_F(Parts, MoreThanTheLimitIsRefusedAtThePartThatPassesIt) {
  const std::string half(base::parts_bytes_max / 2, 'x');
  EXPECT_TRUE(Sender::is_silent(sender_.part(upload, half)));
  EXPECT_TRUE(Sender::is_silent(sender_.part(upload, half)));
  expect_refused(sender_.part(upload, "x"), upload, v1::Error::LIMIT_EXCEEDED, "part");
}

TEST_F(Parts, EachIsACommandOfTheSessionsRate) {
  base::Limits limits;
  limits.commands_burst = 4.0;
  MessageParts parts(limits);
  Sender sender(parts, 8, limits);  // hello took one
  EXPECT_EQ(sender.welcome().parts_bytes_max(), 2 * limits.message_bytes_max) << "what passes the rate";
  Sender other(parts, 9, limits);
  expect_refused(other.part(upload, std::string(2 * limits.message_bytes_max + 1, 'x')), upload,
                 v1::Error::LIMIT_EXCEEDED, "part");
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(Sender::is_silent(sender.part(upload, "x")));
  const auto verdict = sender.part(upload, "x");
  expect_refused(verdict, upload, v1::Error::LIMIT_EXCEEDED, "");
  EXPECT_GT(verdict.reply->error().retry_after_s(), 0.0);
  EXPECT_TRUE(Sender::is_silent(sender.part(upload, "x", true)));
}

TEST_F(Parts, TheRoomForAllSessionsIsBounded) {
  const auto senders = fill_room();
  const auto verdict = sender_.part(upload, "x");
  expect_refused(verdict, upload, v1::Error::UNAVAILABLE, "part");
  EXPECT_GT(verdict.reply->error().retry_after_s(), 0.0);

  parts_.session_ended(first_other_id + senders.size() - 1);
  EXPECT_TRUE(Sender::is_silent(sender_.part(6, "x")));
  expect_refused(senders.front()->part(upload, "x"), upload, v1::Error::LIMIT_EXCEEDED, "part");
}

TEST_F(Parts, OneClientHasHalfOfTheRoomAtMost) {
  base::Limits limits;
  limits.parts_waiting_bytes_max = 4 * parts_.bytes_max();
  MessageParts parts(limits);
  const std::string part(limits.message_bytes_max, 'x');
  const PartView view{.data = part, .last = false};
  std::uint64_t session = 0;
  std::size_t taken = 0;
  while (parts.take(++session, "greedy", upload, view, start).refused.ok()) taken += part.size();
  EXPECT_LE(taken, 2 * parts.bytes_max());
  EXPECT_GT(taken, 2 * parts.bytes_max() - 2 * part.size());
  EXPECT_TRUE(parts.take(++session, "another", upload, view, start).refused.ok());
}

TEST_F(Parts, ThoseThatStoppedComingGiveWay) {
  const auto senders = fill_room();
  const auto later = start + base::parts_timeout + std::chrono::seconds(1);
  EXPECT_TRUE(Sender::is_silent(sender_.part(upload, "x", false, later)));
  expect_refused(senders.front()->part(upload, "x", true, later), upload, v1::Error::UNAVAILABLE, "part");
  EXPECT_TRUE(Sender::is_silent(senders.back()->part(6, "x", false, later))) << "another message may begin";
}

TEST_F(Parts, ThoseThatComeByteByByteGiveWayToo) {
  using std::chrono::seconds;
  const std::string most(base::parts_bytes_max - 16, 'x');
  std::vector<std::unique_ptr<Sender>> senders;
  std::uint64_t id = 100;
  for (std::size_t held = 0; held < base::Limits().parts_waiting_bytes_max; held += base::parts_bytes_max) {
    senders.push_back(std::make_unique<Sender>(parts_, ++id));
    EXPECT_TRUE(Sender::is_silent(senders.back()->part(upload, most)));
    EXPECT_TRUE(Sender::is_silent(senders.back()->part(upload, "x", false, start + seconds(29))));
  }
  EXPECT_TRUE(Sender::is_silent(sender_.part(upload, "x", false, start + seconds(31))));
  expect_refused(senders.front()->part(upload, "x", true, start + seconds(58)), upload, v1::Error::UNAVAILABLE, "part");
}

TEST_F(Parts, APaceOfAFullPartInTheTimeOutIsKept) {
  const std::string whole = edit(upload, 4 * base::Limits().message_bytes_max);
  const std::size_t part_bytes = base::Limits().message_bytes_max / 4;
  auto now = start;
  std::size_t begin = 0;
  for (; begin + part_bytes < whole.size(); begin += part_bytes) {
    EXPECT_TRUE(Sender::is_silent(sender_.part(upload, whole.substr(begin, part_bytes), false, now)));
    now += base::parts_timeout / 4;
  }
  EXPECT_TRUE(sender_.part(upload, whole.substr(begin), true, now).request);
}

// The room is for so many bytes, whatever they come in: a message of single bytes is not put in pieces of its own.
TEST_F(Parts, SmallPartsTakeNoMoreThanTheirBytes) {
  base::Limits limits;
  limits.commands_burst = 1e9;
  Sender sender(parts_, 8, limits);
  const std::size_t before = mallinfo2().uordblks;
  for (std::size_t i = 0; i < 100'000; ++i) EXPECT_TRUE(Sender::is_silent(sender.part(upload, "x")));
  EXPECT_LT(mallinfo2().uordblks, before + 400'000);
}

TEST_F(Parts, WhatWouldTakeTooMuchMemoryIsRefusedUnread) {
  // Empty bodies: two bytes each on the wire.
  v1::ClientMessage message;
  message.set_request_id(upload);
  v1::Scene& scene = *message.mutable_create_world()->mutable_scene();
  for (std::size_t i = 0; i < base::message_memory_bytes_max / sizeof(v1::SoftBody); ++i) scene.add_soft_bodies();
  const std::string bytes = message.SerializeAsString();
  ASSERT_LT(bytes.size(), base::parts_bytes_max);
  expect_refused(sender_.cut(upload, bytes, 1U << 20U), upload, v1::Error::LIMIT_EXCEEDED, "part");
}

TEST_F(Parts, WhatIsKeptAsUnknownIsRefusedUnreadToo) {
  // The request id as bytes, none of them: each is kept as a text of its own.
  std::string bytes;
  while (bytes.size() < base::parts_bytes_max / 2) bytes.append("\x0a\x00", 2);
  expect_refused(sender_.cut(upload, bytes, 1U << 20U), upload, v1::Error::LIMIT_EXCEEDED, "part");
}

}  // namespace
}  // namespace pneuma::app
