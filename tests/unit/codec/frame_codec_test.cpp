// Shows that what the writer makes the reader reads back, within the bound, on bodies that rest, move, leap and fly
// apart; that a key frame takes the place of all frames before it; and that no bytes whatever (random, flipped, cut
// short) crash the reader or leave a trace when refused.
#include "codec/frame_codec.h"

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "unit/codec/meshes.h"

namespace pneuma::codec {
namespace {

using Random = std::mt19937_64;
using Positions = std::vector<double>;

constexpr double max_error_m = 1e-3;

Positions cloud(Random& random, std::size_t vertices, double extent_m) {
  std::uniform_real_distribution<double> coordinate(-extent_m, extent_m);
  Positions positions_m(3 * vertices);
  for (double& value : positions_m) value = coordinate(random);
  return positions_m;
}

Positions moved(Random& random, Positions positions_m, double distance_m) {
  std::uniform_real_distribution<double> move(-distance_m, distance_m);
  for (double& value : positions_m) value += move(random);
  return positions_m;
}

/// A stream of its own: a writer, and a reader that has read all of it.
class Stream {
 public:
  explicit Stream(std::vector<MeshOrderPtr> orders, double error_m = max_error_m)
      : orders_(orders), error_m_(error_m), writer_(orders, error_m), reader_(orders) {}

  std::string begin(const std::vector<Positions>& bodies) {
    for (std::size_t i = 0; i < bodies.size(); ++i) writer_.place_body(i, bodies[i]);
    std::string payload = key();
    read(payload, true, bodies);
    return payload;
  }
  std::string next(const std::vector<Positions>& bodies) {
    std::string payload;
    writer_.begin_delta();
    for (std::size_t i = 0; i < bodies.size(); ++i) writer_.move_body(i, bodies[i]);
    writer_.take_delta(payload);
    read(payload, false, bodies);
    return payload;
  }
  [[nodiscard]] std::string key() const {
    std::string payload;
    writer_.write_key(payload);
    return payload;
  }
  [[nodiscard]] const FrameReader& reader() const { return reader_; }

  /// The reader is where the writer is, and within the bound of `bodies`.
  void read(const std::string& payload, bool key, const std::vector<Positions>& bodies) {
    const auto status = reader_.read(payload, key);
    ASSERT_TRUE(status.ok()) << status.message();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      Positions decoded_m(bodies[i].size());
      reader_.positions(i, writer_.grid_step_m(), decoded_m);
      for (std::size_t j = 0; j < decoded_m.size(); j += 3) {
        EXPECT_LE(std::hypot(decoded_m[j] - bodies[i][j], decoded_m[j + 1] - bodies[i][j + 1],
                             decoded_m[j + 2] - bodies[i][j + 2]),
                  error_m_);
      }
    }
  }

 private:
  std::vector<MeshOrderPtr> orders_;
  double error_m_;
  FrameWriter writer_;
  FrameReader reader_;
};

TEST(FrameCodec, BodiesThatRestMoveAndLeapStayWithinTheBound) {
  Random random(2);
  Stream stream({sheet_order(5, 7), order_of(4, tetrahedron), sheet_order(1, 1), order_of(3, {}), order_of(0, {})});
  std::vector<Positions> bodies;
  for (const std::size_t vertices : {35U, 4U, 1U, 3U, 0U}) bodies.push_back(cloud(random, vertices, 2.0));
  stream.begin(bodies);
  for (int frame = 0; frame < 300; ++frame) {
    for (Positions& body : bodies) {
      switch (random() % 5) {
        case 0:
          break;
        case 1:
          body = moved(random, body, 0.5 * max_error_m);
          break;
        case 2:
          body = moved(random, body, 0.1);
          break;
        case 3:
          for (double& value : body) value += 0.3;
          break;
        default:
          body = cloud(random, body.size() / 3, 1e5);
          break;
      }
    }
    stream.next(bodies);
  }
}

TEST(FrameCodec, FinestBoundHoldsAcrossTheLargestWorld) {
  // Points up to 2^45 steps apart: past any move, and any one body's differences.
  Random random(3);
  Stream stream({sheet_order(4, 4)}, base::max_error_min_m);
  stream.begin({cloud(random, 16, base::coordinate_max_m)});
  for (int frame = 0; frame < 20; ++frame) stream.next({cloud(random, 16, base::coordinate_max_m)});
  stream.next({cloud(random, 16, 1.0)});
  Stream late({sheet_order(4, 4)}, base::max_error_min_m);
  late.begin({cloud(random, 16, 1.0)});
}

TEST(FrameCodec, BodyThatMovesLessThanTheBoundCostsTwoBytes) {
  Random random(4);
  Stream stream({sheet_order(50, 50)});
  const Positions body = cloud(random, 2'500, 1.0);
  stream.begin({body});
  EXPECT_EQ(stream.next({body}).size(), 2U);
  // Not a mean error from where it was decoded, but not a bound either.
  Positions decoded_m(body.size());
  stream.reader().positions(0, grid_step_m(max_error_m), decoded_m);
  EXPECT_EQ(stream.next({moved(random, decoded_m, 0.5 * max_error_m)}).size(), 2U);
}

TEST(FrameCodec, KeyFrameTakesThePlaceOfAllBefore) {
  Random random(5);
  const auto order = sheet_order(9, 9);
  Stream stream({order});
  Positions body = cloud(random, 81, 1.0);
  stream.begin({body});
  for (int frame = 0; frame < 10; ++frame) {
    for (std::size_t i = 0; i < body.size(); ++i) body[i] += 0.01 * std::sin(static_cast<double>(i) + 0.3 * frame);
    stream.next({body});
    FrameReader joined({order});
    ASSERT_TRUE(joined.read(stream.key(), true).ok());
    const Positions before = body;
    for (double& value : body) value += 0.02;
    const std::string delta = stream.next({body});
    const auto status = joined.read(delta, false);
    ASSERT_TRUE(status.ok()) << status.message();
    Lattice ours(body.size());
    Lattice theirs(body.size());
    joined.points(0, ours);
    stream.reader().points(0, theirs);
    EXPECT_EQ(ours, theirs);
  }
}

TEST(FrameCodec, SteadyMotionOfAllVerticesIsNearlyFree) {
  Random random(6);
  Stream stream({sheet_order(40, 40)});
  Positions body = cloud(random, 1'600, 1.0);
  for (double& value : body)
    value = std::round(value / grid_step_m(max_error_m) / 2.0) * 2.0 * grid_step_m(max_error_m);
  stream.begin({body});
  std::size_t bytes = 0;
  for (int frame = 0; frame < 10; ++frame) {
    for (double& value : body) value += 10.0 * grid_step_m(max_error_m);
    bytes = stream.next({body}).size();
  }
  EXPECT_LE(8.0 * static_cast<double>(bytes) / 1'600.0, 0.25);
}

TEST(FrameCodec, OneFarVertexDoesNotMakeTheOthersDear) {
  Random random(7);
  const Positions body = cloud(random, 1'600, 1.0);
  const Positions near = moved(random, body, 2.0 * max_error_m);
  Positions far = near;
  far[2'000] += 50.0;
  Stream one({sheet_order(40, 40)});
  Stream other({sheet_order(40, 40)});
  one.begin({body});
  other.begin({body});
  EXPECT_LE(other.next({far}).size(), 1.1 * static_cast<double>(one.next({near}).size()));
}

/// What a reader may be sent, and the reader as it was before.
struct Sample {
  std::vector<MeshOrderPtr> orders{sheet_order(4, 5), order_of(4, tetrahedron)};
  FrameReader before;
  std::string key;
  std::string delta;
};
Sample make_sample() {
  Random random(8);
  Sample sample;
  Stream stream(sample.orders);
  std::vector<Positions> bodies{cloud(random, 20, 1.0), cloud(random, 4, 1.0)};
  stream.begin(bodies);
  for (int frame = 0; frame < 5; ++frame) {
    sample.before = stream.reader();
    bodies[0] = moved(random, bodies[0], 0.02);
    sample.delta = stream.next(bodies);
  }
  sample.key = stream.key();
  return sample;
}

std::vector<std::int64_t> all_points(const Sample& sample, const FrameReader& reader) {
  std::vector<std::int64_t> all;
  for (std::size_t i = 0; i < sample.orders.size(); ++i) {
    Lattice points(3 * sample.orders[i]->size());
    reader.points(i, points);
    all.insert(all.end(), points.begin(), points.end());
  }
  return all;
}

/// Refused bytes leave the reader as it was: it reads on.
void expect_no_trace(const Sample& sample, const std::string& payload, bool key) {
  FrameReader reader = sample.before;
  const auto status = reader.read(payload, key);
  if (status.ok()) return;
  EXPECT_EQ(status.code(), base::StatusCode::malformed);
  EXPECT_FALSE(status.what().empty());
  EXPECT_FALSE(status.where().empty());
  EXPECT_EQ(all_points(sample, reader), all_points(sample, sample.before));
  FrameReader untouched = sample.before;
  ASSERT_TRUE(untouched.read(sample.delta, false).ok());
  ASSERT_TRUE(reader.read(sample.delta, false).ok());
  EXPECT_EQ(all_points(sample, reader), all_points(sample, untouched));
}

TEST(FrameCodec, EveryTruncationIsRefused) {
  const Sample sample = make_sample();
  for (const bool key : {false, true}) {
    const std::string& payload = key ? sample.key : sample.delta;
    for (std::size_t size = 0; size < payload.size(); ++size) {
      FrameReader reader = sample.before;
      EXPECT_FALSE(reader.read(std::string_view(payload).substr(0, size), key).ok()) << size << " bytes";
      expect_no_trace(sample, payload.substr(0, size), key);
    }
    expect_no_trace(sample, payload + '\0', key);
    FrameReader odd = sample.before;
    EXPECT_FALSE(odd.read(payload + '\0', key).ok());
    FrameReader reader = sample.before;
    EXPECT_FALSE(reader.read(payload + std::string(2, '\0'), key).ok());
  }
}

TEST(FrameCodec, EveryBitFlipIsRefusedOrRead) {
  const Sample sample = make_sample();
  for (const bool key : {false, true}) {
    const std::string& payload = key ? sample.key : sample.delta;
    for (std::size_t bit = 0; bit < 8 * payload.size(); ++bit) {
      std::string flipped = payload;
      flipped[bit / 8] = static_cast<char>(static_cast<unsigned char>(flipped[bit / 8]) ^ (1U << (bit % 8)));
      expect_no_trace(sample, flipped, key);
    }
  }
}

TEST(FrameCodec, RandomBytesAreRefusedOrRead) {
  const Sample sample = make_sample();
  Random random(9);
  for (int round = 0; round < 50'000; ++round) {
    std::string payload(random() % 96, '\0');
    for (char& byte : payload) byte = static_cast<char>(static_cast<unsigned char>(random()));
    if (!payload.empty()) payload[0] = sample.delta[0];  // past the first check
    if (payload.size() > 1) payload[1] = static_cast<char>(random() % 5);
    expect_no_trace(sample, payload, random() % 2 == 0);
  }
}

TEST(FrameCodec, RefusalSaysWhereAndWhat) {
  Sample sample = make_sample();
  const auto refusal = [&](std::string payload, bool key) { return sample.before.read(payload, key).message(); };
  EXPECT_EQ(refusal("", false), "payload: is empty");
  EXPECT_EQ(refusal(std::string("\x02"), false), "payload: is of format 2, which is not known");
  std::string bad_mode = sample.delta;
  bad_mode[1] = 5;
  EXPECT_EQ(refusal(bad_mode, false), "bodies[0]: no such block mode: 5");
  EXPECT_EQ(refusal(sample.delta, true), "bodies[0]: a key frame's block builds on a base");
}

}  // namespace
}  // namespace pneuma::codec
