// Shows that no message takes more memory, has more fields or is nested deeper than was found from its bytes before
// they were parsed, hostile ones included, and that what good messages take is not overestimated by far.
#include "app/message_memory.h"

#include <algorithm>
#include <limits>
#include <random>
#include <string>

#include <google/protobuf/arena.h>
#include <gtest/gtest.h>

#include "base/limits.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {
namespace {

constexpr std::size_t any_number = std::numeric_limits<std::size_t>::max();

base::Result<MessageSize> measure(const std::string& bytes, const MessageSize& most = {any_number, any_number}) {
  return measure_message(bytes, *v1::ClientMessage::descriptor(), most);
}

bool takes_at_most(const std::string& bytes, std::size_t bytes_max) {
  return measure(bytes, {bytes_max, any_number}).ok();
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

TEST(MessageMemory, OfTheLargestWorldsMeshesIsTaken) {
  v1::ClientMessage message;
  v1::Mesh::Triangles& triangles = *message.mutable_create_world()->mutable_scene()->add_meshes()->mutable_triangles();
  for (std::size_t i = 0; i < 3 * 4 * base::world_vertices_max; ++i) {
    triangles.add_indices(static_cast<std::uint32_t>(i % base::mesh_vertices_max));
  }
  EXPECT_TRUE(takes_at_most(message.SerializeAsString(), base::message_memory_bytes_max));
}

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
    ASSERT_FALSE(takes_at_most(bytes, least))
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
    EXPECT_FALSE(takes_at_most(bytes, parsed.SpaceUsedLong() - 1));
    EXPECT_TRUE(takes_at_most(bytes, 3 * parsed.SpaceUsedLong()));
  }
}

TEST(MessageMemory, OnAnArenaIsNeverUnderestimated) {
  v1::ClientMessage bodies;
  for (int i = 0; i < 20'000; ++i) bodies.mutable_create_world()->mutable_scene()->add_soft_bodies();
  v1::ClientMessage mesh;
  v1::Mesh::Triangles& triangles = *mesh.mutable_create_world()->mutable_scene()->add_meshes()->mutable_triangles();
  for (std::uint32_t i = 0; i < 200'000; ++i) triangles.add_indices(i);
  v1::ClientMessage names;
  for (int i = 0; i < 20'000; ++i) names.mutable_subscribe()->add_bodies("a name that is no short one");
  for (const v1::ClientMessage& message : {bodies, mesh, names}) {
    const std::string bytes = message.SerializeAsString();
    google::protobuf::Arena arena;
    ASSERT_TRUE(google::protobuf::Arena::CreateMessage<v1::ClientMessage>(&arena)->ParseFromString(bytes));
    const auto size = measure(bytes);
    ASSERT_TRUE(size.ok());
    EXPECT_GT(size->bytes, arena.SpaceUsed());
  }
}

TEST(MessageMemory, FieldsAreCountedThroughAllDepths) {
  v1::ClientMessage message;
  v1::Mesh::Triangles& triangles = *message.mutable_create_world()->mutable_scene()->add_meshes()->mutable_triangles();
  for (int i = 0; i < 100; ++i) triangles.add_positions()->set_x(1.0);
  const std::string bytes = message.SerializeAsString();
  constexpr std::size_t fields = 4 + 2 * 100;  // create_world, scene, mesh, triangles; each position and its x
  ASSERT_TRUE(measure(bytes, {any_number, fields}).ok());
  EXPECT_EQ(measure(bytes)->fields, fields);
  EXPECT_EQ(measure(bytes, {any_number, fields - 1}).status().code(), base::StatusCode::limit_exceeded);
}

TEST(MessageMemory, NumbersThatReplaceEachOtherAreFieldsToo) {
  std::string bytes;
  for (int i = 0; i < 1'000; ++i) bytes.append("\x08\x07", 2);
  EXPECT_FALSE(measure(bytes, {any_number, 999}).ok());
  EXPECT_EQ(measure(bytes)->fields, 1'000U);
}

// Unknown groups may nest to any depth on the wire; protobuf gives up at its own, and so does the measure.
TEST(MessageMemory, GroupsAreFollowedNoDeeperThanProtobufDoes) {
  std::string bytes;
  for (int i = 0; i < 1'000; ++i) bytes.append("\x7b", 1);
  EXPECT_TRUE(measure(bytes).ok()) << "it takes what comes before the break";
  EXPECT_FALSE(v1::ClientMessage().ParseFromString(bytes));
}

}  // namespace
}  // namespace pneuma::app
