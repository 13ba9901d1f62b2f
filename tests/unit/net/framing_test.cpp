// Shows that messages come out of a byte stream whole and in order however it is cut, and that a length which cannot be
// taken is refused as soon as it is known. The stream is built by hand from the rule: 4 bytes, most significant first,
// then the message.
#include "net/framing.h"

#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::net {
namespace {

using base::StatusCode;
using namespace std::string_literals;

std::string framed(const std::string& message) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>((message.size() >> shift) & 0xFFU));
  return bytes + message;
}

// Everything that a part of the stream completes.
std::vector<std::string> take_all(FrameReader& reader, std::string_view bytes) {
  std::vector<std::string> messages;
  while (true) {
    auto message = reader.take(bytes);
    EXPECT_TRUE(message.ok()) << message.status().message();
    if (!message.ok() || !*message) return messages;
    messages.push_back(std::move(**message));
  }
}

TEST(Framing, PrefixIsBigEndian) {
  const auto prefix = length_prefix(0x01020304);
  EXPECT_EQ(std::string(prefix.data(), prefix.size()), "\x01\x02\x03\x04"s);
}

TEST(Framing, AMessageMayBeCutAtEveryByte) {
  const std::string stream = framed("first") + framed(std::string(300, 'x')) + framed("z");
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    FrameReader reader(300);
    auto messages = take_all(reader, std::string_view(stream).substr(0, cut));
    for (auto& message : take_all(reader, std::string_view(stream).substr(cut))) messages.push_back(std::move(message));
    EXPECT_EQ(messages, (std::vector<std::string>{"first", std::string(300, 'x'), "z"})) << "cut at " << cut;
    EXPECT_FALSE(reader.in_message());
  }
}

TEST(Framing, ATlsClientsFirstBytesAreToldApart) {
  FrameReader reader(500);
  std::string_view hello("\x16\x03\x01\x02\x00\x01", 6);
  const auto taken = reader.take(hello);
  EXPECT_EQ(taken.status().code(), base::StatusCode::malformed);
  EXPECT_EQ(taken.status().what(), "the client speaks TLS, and this port does not");
}

TEST(Framing, AnyChunksGiveTheSameMessages) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    std::vector<std::string> sent;
    std::string stream;
    for (int i = 0; i < 20; ++i) {
      sent.emplace_back(1 + random() % 500, static_cast<char>('a' + i));
      stream += framed(sent.back());
    }
    FrameReader reader(500);
    std::vector<std::string> received;
    for (std::size_t at = 0; at < stream.size();) {
      const std::size_t size = 1 + random() % 700;
      for (auto& message : take_all(reader, std::string_view(stream).substr(at, size)))
        received.push_back(std::move(message));
      at += size;
    }
    EXPECT_EQ(received, sent);
  }
}

TEST(Framing, InMessageFromTheFirstByteOfItsLengthToItsLast) {
  FrameReader reader(10);
  EXPECT_FALSE(reader.in_message());
  const std::string stream = framed("abc");
  for (std::size_t i = 0; i + 1 < stream.size(); ++i) {
    EXPECT_TRUE(take_all(reader, std::string_view(stream).substr(i, 1)).empty());
    EXPECT_TRUE(reader.in_message()) << i;
  }
  EXPECT_EQ(take_all(reader, std::string_view(stream).substr(stream.size() - 1)).size(), 1U);
  EXPECT_FALSE(reader.in_message());
}

TEST(Framing, ALengthPastTheLimitIsRefusedBeforeItsMessageComes) {
  for (const std::string& prefix : {"\0\0\0\x0B"s, "\xFF\xFF\xFF\xFF"s, "\0\0\0\0"s}) {
    FrameReader reader(10);
    std::string_view bytes = prefix;
    const auto refused = reader.take(bytes);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.status().code(), StatusCode::malformed);
    EXPECT_NE(refused.status().what().find("10"), std::string::npos) << "the limit is named";
    std::string_view more = "\0\0\0\1a";
    EXPECT_FALSE(reader.take(more).ok()) << "what follows cannot be trusted";
  }
}

TEST(Framing, ANewLimitCountsFromTheNextLengthOn) {
  FrameReader reader(4);
  const std::string stream = framed("four") + framed("longer than four");
  std::string_view bytes = stream;
  ASSERT_TRUE(reader.take(bytes).ok());
  reader.set_limit(16);
  const auto second = reader.take(bytes);
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(**second, "longer than four");
}

}  // namespace
}  // namespace pneuma::net
