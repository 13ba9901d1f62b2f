// Shows how a message becomes whole from its parts, and what each part is told that cannot be one: the gate of a
// session takes made-up bytes at made-up times.
#include "app/message_parts.h"

#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <malloc.h>

#include "app/message_memory.h"
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
      : gate_(session_id, "", limits, parts) {
    v1::ClientMessage message;
    message.set_request_id(1);
    message.mutable_hello()->set_protocol_version(1);
    welcome_ = gate_.receive(message.SerializeAsString(), start).reply->welcome();
  }

  [[nodiscard]] const v1::Welcome& welcome() const { return welcome_; }

  SessionGate::Verdict say(const std::string& bytes, SessionGate::TimePoint now = start) {
    return gate_.receive(bytes, now);
  }
  SessionGate::Verdict part(std::uint64_t request_id, const std::string& data, bool last = false,
                            SessionGate::TimePoint now = start) {
    v1::ClientMessage message;
    message.set_request_id(request_id);
    message.mutable_part()->set_data(data);
    message.mutable_part()->set_last(last);
    return gate_.receive(message.SerializeAsString(), now);
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
    for (std::size_t held = 0; held < base::parts_waiting_bytes_max; held += largest.size()) {
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
  EXPECT_EQ(verdict.request->SerializeAsString(), largest);
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
  for (std::size_t held = 0; held < base::parts_waiting_bytes_max; held += base::parts_bytes_max) {
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

TEST(MessageMemory, OfTheLargestWorldsMeshesIsTaken) {
  v1::ClientMessage message;
  v1::Mesh::Triangles& triangles = *message.mutable_create_world()->mutable_scene()->add_meshes()->mutable_triangles();
  for (std::size_t i = 0; i < 3 * 4 * base::world_vertices_max; ++i) {
    triangles.add_indices(static_cast<std::uint32_t>(i % base::mesh_vertices_max));
  }
  EXPECT_TRUE(
      takes_at_most(message.SerializeAsString(), *v1::ClientMessage::descriptor(), base::message_memory_bytes_max));
}

/// Fields of a message, the known ones and others, of any wire type whatever the field's own is, and of contents that
/// are often empty.
class HostileWriter {
 public:
  explicit HostileWriter(std::uint64_t seed) : random_(seed) {}

  std::string message(const google::protobuf::Descriptor* descriptor, int depth) {
    std::string out;
    const std::size_t kinds = 1 + below(3);
    for (std::size_t kind = 0; kind < kinds; ++kind) {
      const google::protobuf::FieldDescriptor* field = nullptr;
      std::uint32_t number = 1 + static_cast<std::uint32_t>(below(15));
      if (descriptor != nullptr && descriptor->field_count() > 0 && below(8) > 0) {
        field = descriptor->field(static_cast<int>(below(static_cast<std::size_t>(descriptor->field_count()))));
        number = static_cast<std::uint32_t>(field->number());
      }
      const auto* inner = field != nullptr ? field->message_type() : nullptr;
      const std::uint32_t wire_type = below(4) > 0 ? 2 : static_cast<std::uint32_t>(below(6));
      // One of many is where a list's spare room shows; one alone, where its head does.
      const std::string once = this->field(number, wire_type, inner, depth);
      const std::size_t times = once.size() > 40 || below(2) == 0 ? 1 : 1 + below(40);
      for (std::size_t i = 0; i < times; ++i) out += once;
    }
    return out;
  }
  std::size_t below(std::size_t end) { return std::uniform_int_distribution<std::size_t>(0, end - 1)(random_); }

 private:
  std::string field(std::uint32_t number, std::uint32_t wire_type, const google::protobuf::Descriptor* inner,
                    int depth) {
    const std::string tag = varint(number << 3U | wire_type);
    switch (wire_type) {
      case 0:
        return tag + varint(static_cast<std::uint32_t>(below(1'000)));
      case 1:
        return tag + std::string(8, 'x');
      case 2: {
        const std::string content = depth < 6 && below(8) > 0 && inner != nullptr
                                        ? message(inner, depth + 1)
                                        : std::string(below(3) * below(30), 1);
        return tag + varint(static_cast<std::uint32_t>(content.size())) + content;
      }
      case 3:
        return tag + (depth < 6 ? message(nullptr, depth + 1) : "") + varint(number << 3U | 4U);
      case 5:
        return tag + std::string(4, 'x');
      default:
        return tag;  // the end of a group that never began
    }
  }
  static std::string varint(std::uint32_t value) {
    std::string out;
    for (; value >= 0x80U; value >>= 7U) out += static_cast<char>((value & 0x7fU) | 0x80U);
    return out += static_cast<char>(value);
  }

  std::mt19937_64 random_;
};

// What cannot be parsed to its end takes memory up to there, with the field that it breaks off in.
TEST(MessageMemory, OfHostileBytesIsNeverUnderestimated) {
  constexpr std::size_t begun_bytes = 512;
  std::size_t parsed_whole = 0;
  for (std::uint64_t seed = 0; seed < 20'000; ++seed) {
    HostileWriter writer(seed);
    std::string bytes = writer.message(v1::ClientMessage::descriptor(), 0);
    if (writer.below(4) == 0) bytes.resize(writer.below(bytes.size() + 1));
    v1::ClientMessage parsed;
    const bool is_whole = parsed.ParseFromString(bytes);
    if (is_whole) ++parsed_whole;
    const std::size_t beside = is_whole ? 1 : begun_bytes;
    const std::size_t least = std::max(parsed.SpaceUsedLong(), beside) - beside;
    ASSERT_FALSE(takes_at_most(bytes, *v1::ClientMessage::descriptor(), least))
        << "seed " << seed << ": " << parsed.SpaceUsedLong() << " bytes, of " << testing::PrintToString(bytes);
  }
  EXPECT_GT(parsed_whole, 5'000U);
}

// Beside what protobuf says that the parsed message takes.
TEST(MessageMemory, IsNeverUnderestimatedAndNotByFarOverestimated) {
  v1::ClientMessage scene_message;
  v1::Scene& scene = *scene_message.mutable_create_world()->mutable_scene();
  for (int i = 0; i < 50; ++i) scene.add_soft_bodies()->set_name(std::string("body ").append(std::to_string(i)));
  v1::Mesh::Triangles& triangles = *scene.add_meshes()->mutable_triangles();
  for (std::uint32_t i = 0; i < 3'000; ++i) triangles.add_indices(i);
  for (int i = 0; i < 1'000; ++i) triangles.add_positions()->set_x(i);
  v1::ClientMessage names;
  for (int i = 0; i < 300; ++i) names.mutable_subscribe()->add_bodies();
  for (const v1::ClientMessage& message : {scene_message, names}) {
    const std::string bytes = message.SerializeAsString();
    v1::ClientMessage parsed;
    ASSERT_TRUE(parsed.ParseFromString(bytes));
    EXPECT_FALSE(takes_at_most(bytes, *v1::ClientMessage::descriptor(), parsed.SpaceUsedLong() - 1));
    EXPECT_TRUE(takes_at_most(bytes, *v1::ClientMessage::descriptor(), 3 * parsed.SpaceUsedLong()));
  }
}

}  // namespace
}  // namespace pneuma::app
