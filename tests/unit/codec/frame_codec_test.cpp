// Shows that what the encoder writes the decoder reads back, on lattices of every size and spread; what a body at rest
// and a moving one cost; and that no bytes whatever (random, flipped, cut short) crash the decoder or leave a trace
// when refused.
#include "codec/frame_codec.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::codec {
namespace {

using Random = std::mt19937_64;

Lattice random_lattice(Random& random, std::size_t vertices, int bits_max) {
  Lattice lattice(3 * vertices);
  for (std::int64_t& value : lattice) {
    const auto bits = static_cast<int>(random() % static_cast<std::uint64_t>(bits_max + 1));
    value = static_cast<std::int64_t>(bits == 0 ? 0 : random() >> (64 - bits));
    if (random() % 2 == 0) value = static_cast<std::int64_t>(0 - static_cast<std::uint64_t>(value));
  }
  return lattice;
}

/// `base` with each coordinate changed by at most `size`.
Lattice moved(Random& random, const Lattice& base, std::int64_t size) {
  std::uniform_int_distribution<std::int64_t> move(-size, size);
  Lattice lattice = base;
  for (std::int64_t& value : lattice) value += move(random);
  return lattice;
}

TEST(FrameCodec, KeyFrameReadsBackAtEverySizeAndSpread) {
  Random random(1);
  for (std::size_t vertices : {0UL, 1UL, 2UL, 3UL, 7UL, 162UL, 2562UL}) {
    for (int bits = 0; bits <= 64; bits += 4) {
      const Lattice lattice = random_lattice(random, vertices, bits);
      std::string payload;
      encode_key(lattice, payload);
      std::vector<Lattice> bodies{Lattice(lattice.size(), 99)};
      const auto status = decode(payload, true, bodies);
      ASSERT_TRUE(status.ok()) << status.message();
      EXPECT_EQ(bodies[0], lattice) << vertices << " vertices of " << bits << " bits";
    }
  }
}

TEST(FrameCodec, ManyBodiesOfMixedModesReadBack) {
  Random random(2);
  for (int round = 0; round < 200; ++round) {
    std::vector<Lattice> base;
    std::vector<Lattice> next;
    std::string payload;
    for (std::uint64_t body = random() % 6; body < 6; ++body) {
      base.push_back(random_lattice(random, 1 + random() % 50, 30));
      switch (random() % 4) {
        case 0:
          next.push_back(base.back());
          break;
        case 1:
          next.push_back(moved(random, base.back(), 3));
          break;
        case 2:
          next.push_back(moved(random, base.back(), 100'000));
          break;
        default:
          next.push_back(random_lattice(random, base.back().size() / 3, 64));
          break;
      }
      encode_delta(next.back(), base.back(), payload);
    }
    const auto status = decode(payload, false, base);
    ASSERT_TRUE(status.ok()) << status.message();
    EXPECT_EQ(base, next);
  }
}

TEST(FrameCodec, ExtremeCoordinatesWrapAroundAndReadBack) {
  constexpr std::int64_t least = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t most = std::numeric_limits<std::int64_t>::max();
  const Lattice base{least, most, 0, most, least, -1};
  const Lattice next{most, least, -1, least, most, 0};
  std::string payload;
  encode_delta(next, base, payload);
  std::vector<Lattice> bodies{base};
  ASSERT_TRUE(decode(payload, false, bodies).ok());
  EXPECT_EQ(bodies[0], next);

  payload.clear();
  encode_key(base, payload);
  ASSERT_TRUE(decode(payload, true, bodies).ok());
  EXPECT_EQ(bodies[0], base);
}

TEST(FrameCodec, BodyAtRestCostsOneByte) {
  Random random(3);
  const Lattice lattice = random_lattice(random, 10'242, 20);
  std::string payload;
  encode_delta(lattice, lattice, payload);
  EXPECT_EQ(payload.size(), 1U);
}

TEST(FrameCodec, SmallMovesCostNearTheirEntropy) {
  // 15 equally likely moves an axis hold 3 log2(15) = 11.7 bits a vertex; a Rice code of them lies within half a bit an
  // axis.
  Random random(4);
  const Lattice base = random_lattice(random, 5'000, 20);
  std::string payload;
  encode_delta(moved(random, base, 7), base, payload);
  const double bits_a_vertex = 8.0 * static_cast<double>(payload.size()) / 5'000.0;
  EXPECT_LT(bits_a_vertex, 3.0 * (std::log2(15.0) + 0.75));
}

TEST(FrameCodec, OneFarVertexDoesNotMakeTheOthersDear) {
  Random random(5);
  const Lattice base = random_lattice(random, 1'000, 20);
  Lattice next = moved(random, base, 2);
  std::string near;
  encode_delta(next, base, near);
  next[1'500] += std::int64_t{1} << 60;
  std::string far;
  encode_delta(next, base, far);
  EXPECT_LE(far.size(), near.size() + 12);
}

TEST(FrameCodec, LeapIsNotDearerThanAKeyFrame) {
  Random random(6);
  const Lattice lattice = moved(random, Lattice(600, 0), 50);
  std::string key;
  encode_key(lattice, key);
  std::string delta;
  encode_delta(lattice, random_lattice(random, 200, 50), delta);
  EXPECT_LE(delta.size(), key.size());
}

/// Refused bytes leave the bodies as they were; accepted ones leave their sizes.
void expect_no_trace(const std::string& payload, bool key, const std::vector<Lattice>& base) {
  std::vector<Lattice> bodies = base;
  const auto status = decode(payload, key, bodies);
  ASSERT_EQ(bodies.size(), base.size());
  if (status.ok()) {
    for (std::size_t i = 0; i < base.size(); ++i) ASSERT_EQ(bodies[i].size(), base[i].size());
    return;
  }
  EXPECT_EQ(bodies, base);
  EXPECT_EQ(status.code(), base::StatusCode::malformed);
  EXPECT_FALSE(status.what().empty());
  EXPECT_FALSE(status.where().empty());
}

TEST(FrameCodec, EveryTruncationIsRefused) {
  Random random(7);
  const std::vector<Lattice> base{random_lattice(random, 20, 16), random_lattice(random, 3, 40)};
  std::string payload;
  encode_delta(moved(random, base[0], 5), base[0], payload);
  encode_key(random_lattice(random, 3, 40), payload);
  for (std::size_t size = 0; size < payload.size(); ++size) {
    std::vector<Lattice> bodies = base;
    EXPECT_FALSE(decode(std::string_view(payload).substr(0, size), false, bodies).ok()) << size << " bytes";
    EXPECT_EQ(bodies, base);
  }
}

TEST(FrameCodec, EveryBitFlipLeavesNoTraceOrTheSameSizes) {
  Random random(8);
  const std::vector<Lattice> base{random_lattice(random, 20, 16), random_lattice(random, 3, 40)};
  std::string payload;
  encode_delta(moved(random, base[0], 5), base[0], payload);
  encode_delta(base[1], base[1], payload);
  for (std::size_t bit = 0; bit < 8 * payload.size(); ++bit) {
    std::string flipped = payload;
    flipped[bit / 8] = static_cast<char>(static_cast<unsigned char>(flipped[bit / 8]) ^ (1U << (bit % 8)));
    expect_no_trace(flipped, false, base);
    expect_no_trace(flipped, true, base);
  }
}

TEST(FrameCodec, RandomBytesLeaveNoTraceOrTheSameSizes) {
  Random random(9);
  const std::vector<Lattice> base{random_lattice(random, 4, 16), random_lattice(random, 1, 40), {}};
  for (int round = 0; round < 100'000; ++round) {
    std::string payload(random() % 64, '\0');
    for (char& byte : payload) byte = static_cast<char>(static_cast<unsigned char>(random()));
    if (!payload.empty()) payload[0] = static_cast<char>(random() % 3);  // past the first check
    expect_no_trace(payload, random() % 2 == 0, base);
  }
}

TEST(FrameCodec, RefusalNamesTheBodyAndTheVertex) {
  const Lattice lattice{1, 2, 3, 1000, 2000, 3000};
  std::string payload(1, '\0');  // the first body is unchanged
  encode_key(lattice, payload);
  payload.pop_back();
  std::vector<Lattice> bodies{lattice, lattice};
  const auto status = decode(payload, false, bodies);
  EXPECT_EQ(status.message(), "bodies[1]: the payload ends in vertex 1");
}

}  // namespace
}  // namespace pneuma::codec
