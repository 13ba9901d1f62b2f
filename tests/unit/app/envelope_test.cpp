// Shows that which request a message is, and its id, are read off its bytes as protobuf would read them, and that bytes
// made to take long are given up soon.
#include "app/envelope.h"

#include <random>
#include <string>

#include <gtest/gtest.h>

#include "base/limits.h"

namespace pneuma::app {
namespace {

using namespace std::string_literals;

TEST(Envelope, TellsTheRequestAndItsId) {
  v1::ClientMessage message;
  message.set_request_id(300);
  message.mutable_impulse()->set_world("w");
  const std::string bytes = message.SerializeAsString();
  const auto envelope = read_envelope(bytes);
  ASSERT_TRUE(envelope);
  EXPECT_EQ(envelope->request_id, 300U);
  EXPECT_EQ(envelope->request, v1::ClientMessage::kImpulse);
  EXPECT_EQ(envelope->body, message.impulse().SerializeAsString());
}

TEST(Envelope, UnknownFieldsAreSkipped) {
  // Field 30 as a number, field 1000 as bytes, field 31 fixed.
  const auto envelope = read_envelope(
      "\xf0\x01\x05"
      "\xc2\x3e\x01x"
      "\xfd\x01\1\2\3\4"
      "\x08\x09\x1a\x00"s);
  ASSERT_TRUE(envelope);
  EXPECT_EQ(envelope->request_id, 9U);
  EXPECT_EQ(envelope->request, v1::ClientMessage::kListWorlds);
}

TEST(Envelope, ARequestThatIsANumberIsNone) {
  const auto envelope = read_envelope("\x08\x09\x18\x01"s);  // list_worlds: 1
  ASSERT_TRUE(envelope);
  EXPECT_EQ(envelope->request, v1::ClientMessage::REQUEST_NOT_SET);
}

TEST(Envelope, TwoRequestsGroupsAndManyFieldsAreNoMessage) {
  EXPECT_FALSE(read_envelope("\x1a\x00\x1a\x00"s));
  EXPECT_FALSE(read_envelope("\x0b\x0c"s));
  std::string many;
  for (std::size_t i = 0; i < base::envelope_fields_max; ++i) many += "\x08\x07"s;
  EXPECT_TRUE(read_envelope(many));
  EXPECT_FALSE(read_envelope(many + "\x08\x07"s));
}

TEST(Envelope, BytesThatBreakOffAreNoMessage) {
  v1::ClientMessage message;
  message.set_request_id(300);
  message.mutable_impulse()->set_world("world");
  const std::string bytes = message.SerializeAsString();
  for (std::size_t size : {1U, 2U, 4U, 5U, 9U}) EXPECT_FALSE(read_envelope(bytes.substr(0, size))) << size;
  EXPECT_TRUE(read_envelope(bytes.substr(0, 3))) << "between two fields";
}

// What passes is what protobuf makes of it: a role or a rate is asked of the kind that was seen here.
TEST(Envelope, AgreesWithProtobufOnRandomBytes) {
  std::mt19937_64 random(7);
  const auto below = [&random](std::size_t end) {
    return std::uniform_int_distribution<std::size_t>(0, end - 1)(random);
  };
  int agreed = 0;
  for (int round = 0; round < 200'000; ++round) {
    std::string bytes;
    for (std::size_t fields = 1 + below(3); fields > 0; --fields) {
      bytes += static_cast<char>(below(4) == 0 ? below(256) : 8 * (1 + below(20)) + (below(2) == 0 ? 2 : 0));
      if (below(8) == 0) bytes += static_cast<char>(below(256));
      const std::size_t length = below(4);
      bytes += static_cast<char>(length);
      bytes.append(length, static_cast<char>(8 * (1 + below(5))));
    }
    const auto envelope = read_envelope(bytes);
    v1::ClientMessage parsed;
    if (!envelope || !parsed.ParseFromString(bytes)) continue;
    ++agreed;
    ASSERT_EQ(envelope->request_id, parsed.request_id()) << testing::PrintToString(bytes);
    ASSERT_EQ(envelope->request, parsed.request_case()) << testing::PrintToString(bytes);
  }
  EXPECT_GT(agreed, 10'000);
}

TEST(Envelope, APartsDataIsSeenWithoutBeingCopied) {
  v1::Part part;
  part.set_data("some bytes");
  part.set_last(true);
  const std::string bytes = part.SerializeAsString();
  const auto seen = read_part(bytes);
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->data, "some bytes");
  EXPECT_TRUE(seen->last);
  EXPECT_GE(seen->data.data(), bytes.data());
  EXPECT_LE(seen->data.data(), bytes.data() + bytes.size());
  EXPECT_FALSE(read_part(bytes.substr(0, 5)));
}

}  // namespace
}  // namespace pneuma::app
