// Shows that a message is parsed only where what it makes is small enough and there is room for it, that its memory is
// given back with it, and which errors end the connection.
#include "app/request_reader.h"

#include <string>

#include <gtest/gtest.h>
#include <malloc.h>

#include "base/limits.h"

namespace pneuma::app {
namespace {

using base::StatusCode;

const base::MemoryBudget plenty(std::size_t{1} << 30U);

Unread unread(std::string bytes, bool came_in_parts = false) {
  return {5, {std::move(bytes), {}}, came_in_parts};
}

v1::ClientMessage create_world(int bodies) {
  v1::ClientMessage message;
  message.set_request_id(5);
  for (int i = 0; i < bodies; ++i) message.mutable_create_world()->mutable_scene()->add_soft_bodies();
  return message;
}

TEST(RequestReader, ReadsAMessageAndCountsWhatItHolds) {
  const base::MemoryBudget budget(std::size_t{1} << 20U);
  const std::string bytes = create_world(100).SerializeAsString();
  {
    const auto read = read_request(unread(bytes), budget);
    ASSERT_TRUE(read.ok()) << read.status().message();
    EXPECT_EQ(read->message->SerializeAsString(), bytes);
    EXPECT_GE(budget.bytes(), read->message->SpaceUsedLong());
    EXPECT_EQ(read->bytes, budget.bytes());
  }
  EXPECT_EQ(budget.bytes(), 0U);
}

TEST(RequestReader, WhereThereIsNoRoomItIsUnavailable) {
  const base::MemoryBudget small(1'000);
  const auto read = read_request(unread(create_world(100).SerializeAsString()), small);
  EXPECT_EQ(read.status().code(), StatusCode::unavailable);
  EXPECT_EQ(small.bytes(), 0U);
}

TEST(RequestReader, APingIsTakenWhateverElseWaits) {
  const base::MemoryBudget full(1'000);
  const auto held = full.take(1'000);
  v1::ClientMessage ping;
  ping.set_request_id(5);
  ping.mutable_ping();
  EXPECT_TRUE(read_request(unread(ping.SerializeAsString()), full).ok());
  // Nothing else is, however small: it would wait in a world's inbox.
  v1::ClientMessage pause;
  pause.set_request_id(5);
  pause.mutable_pause()->set_world("w");
  EXPECT_EQ(read_request(unread(pause.SerializeAsString()), full).status().code(), StatusCode::unavailable);
  EXPECT_EQ(full.bytes(), 1'000U);
}

// B1 of the list of attacks: 1,040,000 bytes that took a quarter of a gigabyte.
TEST(RequestReader, ManyEmptyFieldsAreRefusedUnparsed) {
  std::string scene;
  for (int i = 0; i < 520'000; ++i) scene.append("\x32\x00", 2);
  v1::ClientMessage message;
  message.set_request_id(5);
  message.mutable_create_world();
  std::string bytes = message.SerializeAsString();
  ASSERT_EQ(bytes.substr(2), std::string("\x22\x00", 2));
  bytes = bytes.substr(0, 3);
  const auto varint = [](std::size_t value) {
    std::string out;
    for (; value >= 0x80U; value >>= 7U) out += static_cast<char>((value & 0x7fU) | 0x80U);
    return out += static_cast<char>(value);
  };
  const std::string create = std::string("\x1a").append(varint(scene.size())).append(scene);
  bytes += varint(create.size()) + create;
  const std::size_t before = mallinfo2().uordblks + mallinfo2().hblkhd;
  const auto read = read_request(unread(bytes), plenty);
  EXPECT_EQ(read.status().code(), StatusCode::limit_exceeded) << read.status().message();
  EXPECT_LT(mallinfo2().uordblks + mallinfo2().hblkhd, before + bytes.size() + 1'000'000);
}

TEST(RequestReader, FieldsWithoutMemoryAreBoundedToo) {
  v1::ClientMessage message = create_world(1);
  std::string bytes = message.SerializeAsString();
  for (std::size_t i = 0; i < base::message_fields_max; ++i) bytes.append("\x08\x05", 2);
  const auto read = read_request(unread(bytes, true), plenty);
  EXPECT_EQ(read.status().code(), StatusCode::limit_exceeded);
  EXPECT_EQ(read.status().where(), "part");
}

TEST(RequestReader, BytesThatAreNoMessageEndTheConnectionUnlessTheyCameInParts) {
  EXPECT_EQ(read_request(unread("\x22\x05xx"), plenty).status().code(), StatusCode::malformed);
  EXPECT_EQ(read_request(unread("\x22\x05xx", true), plenty).status().code(), StatusCode::invalid_argument);
}

TEST(RequestReader, AMessageInPartsHasTheIdOfItsParts) {
  v1::ClientMessage message = create_world(1);
  EXPECT_TRUE(read_request(unread(message.SerializeAsString(), true), plenty).ok());
  message.set_request_id(6);
  EXPECT_EQ(read_request(unread(message.SerializeAsString(), true), plenty).status().where(), "request_id");
}

}  // namespace
}  // namespace pneuma::app
