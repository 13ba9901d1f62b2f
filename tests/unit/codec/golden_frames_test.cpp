// Holds the frame reader and the topology hash to the golden vectors, which a script makes from the format's
// description alone.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "codec/frame_codec.h"
#include "codec/topology_hash.h"
#include "support/golden.h"
#include "unit/codec/meshes.h"

namespace pneuma::codec {
namespace {

std::vector<MeshOrderPtr> orders(const support::GoldenRecord& record) {
  std::vector<MeshOrderPtr> all;
  for (const std::string& value : support::values_of(record, "mesh")) {
    const std::vector<std::int64_t> numbers = support::parse_integers(value);
    all.push_back(order_of(static_cast<std::uint32_t>(numbers.at(0)), {numbers.begin() + 1, numbers.end()}));
  }
  return all;
}

std::vector<Lattice> points_of(const FrameReader& reader, const std::vector<MeshOrderPtr>& orders) {
  std::vector<Lattice> all;
  for (std::size_t i = 0; i < orders.size(); ++i) reader.points(i, all.emplace_back(3 * orders[i]->size()));
  return all;
}

TEST(GoldenFrames, AreReadToTheirPointsOrRefused) {
  const auto records = support::read_golden("frames.txt");
  ASSERT_GE(records.size(), 5U);
  for (const auto& record : records) {
    const auto meshes = orders(record);
    FrameReader reader(meshes);
    std::size_t body = 0;
    std::size_t frame = 0;
    for (const auto& [key, value] : record) {
      SCOPED_TRACE(std::string(record[0].second).append(", frame ").append(std::to_string(frame)));
      if (key == "key" || key == "delta") {
        ++frame;
        const auto status = reader.read(support::parse_hex(value), key == "key");
        ASSERT_TRUE(status.ok()) << status.message();
        body = 0;
      } else if (key == "bad-key" || key == "bad-delta") {
        const auto before = points_of(reader, meshes);
        EXPECT_FALSE(reader.read(support::parse_hex(value), key == "bad-key").ok()) << value;
        EXPECT_EQ(points_of(reader, meshes), before);
      } else if (key == "points") {
        EXPECT_EQ(points_of(reader, meshes).at(body++), support::parse_integers(value));
      }
    }
    EXPECT_GE(frame, 2U) << "a stream says something";
  }
}

TEST(GoldenTopologies, HaveTheirHashes) {
  const auto records = support::read_golden("topologies.txt");
  ASSERT_GE(records.size(), 5U);
  for (const auto& record : records) {
    const auto vertices = static_cast<std::uint32_t>(std::stoul(support::values_of(record, "vertices").at(0)));
    std::vector<std::uint32_t> indices;
    for (const std::int64_t index : support::parse_integers(support::values_of(record, "indices").at(0))) {
      indices.push_back(static_cast<std::uint32_t>(index));
    }
    EXPECT_EQ(topology_hash(vertices, indices), support::parse_hex(support::values_of(record, "hash").at(0)))
        << record[0].second;
  }
}

}  // namespace
}  // namespace pneuma::codec
