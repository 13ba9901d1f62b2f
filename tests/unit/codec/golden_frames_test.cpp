// Holds the frame reader and the topology hash to the golden vectors, which a script makes from the format's
// description alone.
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "codec/frame_codec.h"
#include "codec/topology_hash.h"
#include "support/golden.h"
#include "unit/codec/golden_bodies.h"

namespace pneuma::codec {
namespace {

/// A stream as its record has it, as far as it was read: by a reader that reads it all, and by one that begins with
/// each key frame, which must do without those before it.
class GoldenStream {
 public:
  explicit GoldenStream(const support::GoldenRecord& record) : bodies_(bodies_of(record)) {
    const auto step = support::values_of(record, "grid_step_m");
    if (!step.empty()) grid_step_m_ = std::stod(step[0]);
    reader_ = new_reader();
    fresh_ = new_reader();
  }

  void begin() { fresh_ = new_reader(); }
  /// Of one reader; they must agree.
  [[nodiscard]] base::Status read(const std::string& hexadecimal, bool key) {
    const std::string payload = support::parse_hex(hexadecimal);
    const base::Status status = reader_.read(payload, key);
    EXPECT_EQ(fresh_.read(payload, key).ok(), status.ok());
    return status;
  }
  [[nodiscard]] std::uint32_t check() const {
    EXPECT_EQ(fresh_.check(), reader_.check());
    return reader_.check();
  }
  [[nodiscard]] std::vector<Lattice> points() const {
    EXPECT_EQ(points_of(fresh_), points_of(reader_));
    return points_of(reader_);
  }

 private:
  [[nodiscard]] FrameReader new_reader() const {
    std::vector<MeshOrderPtr> orders;
    std::vector<SimulatedMotionPtr> simulations;
    for (const GoldenBody& body : bodies_) {
      orders.push_back(body.order);
      simulations.push_back(simulation_of(body, grid_step_m_));
    }
    return FrameReader(std::move(orders), std::move(simulations));
  }
  [[nodiscard]] std::vector<Lattice> points_of(const FrameReader& reader) const {
    std::vector<Lattice> all;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      reader.points(i, all.emplace_back(3 * bodies_[i].order->size()));
    }
    return all;
  }

  std::vector<GoldenBody> bodies_;
  double grid_step_m_ = 1.0;
  FrameReader reader_;
  FrameReader fresh_;
};

class GoldenFrames : public testing::TestWithParam<const char*> {};

TEST_P(GoldenFrames, AreReadToTheirPointsOrRefused) {
  const auto records = support::read_golden(GetParam());
  ASSERT_GE(records.size(), 3U);
  for (const auto& record : records) {
    GoldenStream stream(record);
    std::size_t body = 0;
    std::size_t frame = 0;
    for (const auto& [key, value] : record) {
      SCOPED_TRACE(std::string(record[0].second).append(", frame ").append(std::to_string(frame)));
      if (key == "key" || key == "delta") {
        ++frame;
        if (key == "key") stream.begin();
        const auto status = stream.read(value, key == "key");
        ASSERT_TRUE(status.ok()) << status.message();
        body = 0;
      } else if (key == "bad-key" || key == "bad-delta") {
        const auto before = stream.points();
        EXPECT_FALSE(stream.read(value, key == "bad-key").ok()) << value;
        EXPECT_EQ(stream.points(), before);
      } else if (key == "check") {
        EXPECT_EQ(std::to_string(stream.check()), value);
      } else if (key == "points") {
        EXPECT_EQ(stream.points().at(body++), support::parse_integers(value));
      }
    }
    EXPECT_GE(frame, 2U) << "a stream says something";
  }
}

INSTANTIATE_TEST_SUITE_P(All, GoldenFrames, testing::Values("frames.txt", "simulated_frames.txt"),
                         [](const auto& info) { return info.index == 0 ? "Plain" : "Simulated"; });

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
