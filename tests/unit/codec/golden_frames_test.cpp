// Holds the decoder and the topology hash to the golden vectors, which a script makes from the format's description
// alone.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "codec/frame_codec.h"
#include "codec/topology_hash.h"
#include "support/golden.h"

namespace pneuma::codec {
namespace {

std::vector<Lattice> lattices(const support::GoldenRecord& record, const std::string& key) {
  std::vector<Lattice> all;
  for (const std::string& value : support::values_of(record, key)) all.push_back(support::parse_integers(value));
  return all;
}

TEST(GoldenFrames, DecodeToTheirLatticesOrAreRefused) {
  const auto records = support::read_golden("frames.txt");
  ASSERT_GE(records.size(), 20U);
  for (const auto& record : records) {
    SCOPED_TRACE(record[0].second);
    const bool good = record[0].first == "frame";
    const bool key = support::values_of(record, "kind").at(0) == "key";
    const std::string payload = support::parse_hex(support::values_of(record, "payload").at(0));

    const std::vector<Lattice> expected = lattices(record, "lattice");
    std::vector<Lattice> bodies = lattices(record, "base");
    if (good && key) {
      for (const Lattice& lattice : expected) bodies.emplace_back(lattice.size(), 12345);
    }
    const std::vector<Lattice> before = bodies;
    const auto status = decode(payload, key, bodies);
    EXPECT_EQ(status.ok(), good) << status.message();
    EXPECT_EQ(bodies, good ? expected : before);
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
