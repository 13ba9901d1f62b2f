// Shows that a snapshot is fetched whole, piece by piece, that its memory is counted while it lasts, and that it goes
// with its last piece, its session, or when nobody asks for it.
#include "app/snapshot_shelf.h"

#include <vector>

#include <gtest/gtest.h>

#include "base/limits.h"

namespace pneuma::app {
namespace {

class SnapshotShelfTest : public testing::Test {
 protected:
  using TimePoint = SnapshotShelf::TimePoint;

  static std::string large_file() {
    std::string bytes(2 * base::snapshot_piece_bytes + 5, '.');
    for (std::size_t i = 0; i < bytes.size(); i += 1000) bytes[i] = static_cast<char>('a' + i % 26);
    return bytes;
  }
  base::Result<v1::Snapshot> ask(net::SessionId session, std::uint64_t id, std::uint64_t offset, TimePoint now = {}) {
    v1::ReadSnapshot request;
    request.set_snapshot_id(id);
    request.set_offset(offset);
    return shelf_.read(session, request, now);
  }

  const base::MemoryBudget budget_{4 * base::snapshot_piece_bytes};
  SnapshotShelf shelf_{budget_};
};

TEST_F(SnapshotShelfTest, GivesEveryByteOnceAndThenItsMemoryBack) {
  auto piece = shelf_.put(1, "client", {}, large_file(), {});
  ASSERT_TRUE(piece.ok());
  EXPECT_EQ(piece->bytes_total(), large_file().size());
  EXPECT_EQ(budget_.bytes(), large_file().size());
  std::string bytes = piece->data();
  while (bytes.size() < piece->bytes_total()) {
    piece = ask(1, piece->snapshot_id(), bytes.size());
    ASSERT_TRUE(piece.ok()) << piece.status().message();
    ASSERT_LE(piece->data().size(), base::snapshot_piece_bytes);
    EXPECT_EQ(piece->offset(), bytes.size());
    bytes += piece->data();
  }
  EXPECT_EQ(bytes, large_file());
  EXPECT_EQ(budget_.bytes(), 0U);
  EXPECT_EQ(ask(1, piece->snapshot_id(), 0).status().code(), base::StatusCode::not_found);
}

TEST_F(SnapshotShelfTest, ASmallOneIsNotKept) {
  const auto piece = shelf_.put(1, "client", {}, "small", {});
  ASSERT_TRUE(piece.ok());
  EXPECT_EQ(piece->data(), "small");
  EXPECT_EQ(ask(1, piece->snapshot_id(), 0).status().code(), base::StatusCode::not_found);
}

TEST_F(SnapshotShelfTest, OneASessionAndNobodyElses) {
  const auto first = shelf_.put(1, "client", {}, large_file(), {});
  const auto second = shelf_.put(1, "client", {}, large_file(), {});
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(ask(1, first->snapshot_id(), 0).status().code(), base::StatusCode::not_found);
  EXPECT_EQ(ask(2, second->snapshot_id(), 0).status().code(), base::StatusCode::not_found);
  EXPECT_TRUE(ask(1, second->snapshot_id(), 0).ok());
  EXPECT_EQ(ask(1, second->snapshot_id(), large_file().size()).status().code(), base::StatusCode::invalid_argument);
  shelf_.drop(1);
  EXPECT_EQ(budget_.bytes(), 0U);
}

TEST_F(SnapshotShelfTest, WithoutMemoryForItNoneIsTaken) {
  ASSERT_TRUE(shelf_.put(1, "client", {}, large_file(), {}).ok());
  EXPECT_EQ(shelf_.put(2, "client", {}, large_file(), {}).status().code(), base::StatusCode::unavailable);
}

TEST_F(SnapshotShelfTest, AClientHasTwoWhateverItsSessions) {
  SnapshotShelf shelf{base::MemoryBudget(1'000 * base::snapshot_piece_bytes)};
  const auto is_held = [&](net::SessionId session, std::uint64_t id) {
    v1::ReadSnapshot request;
    request.set_snapshot_id(id);
    return shelf.read(session, request, {}).ok();
  };
  const auto others = shelf.put(9, "another", {}, large_file(), {});
  std::vector<std::uint64_t> ids;
  for (net::SessionId session = 1; session <= 4; ++session) {
    ids.push_back(shelf.put(session, "client", {}, large_file(), {})->snapshot_id());
  }
  EXPECT_FALSE(is_held(1, ids[0]));
  EXPECT_FALSE(is_held(2, ids[1]));
  EXPECT_TRUE(is_held(3, ids[2]));
  EXPECT_TRUE(is_held(4, ids[3]));
  EXPECT_TRUE(is_held(9, others->snapshot_id()));
}

// The rest is for worlds.
TEST_F(SnapshotShelfTest, AnEighthOfTheMemoryIsForSnapshots) {
  const base::MemoryBudget memory(1'600 * base::world_file_bytes_max / 100);
  SnapshotShelf shelf{memory};
  const std::string file(base::world_file_bytes_max, '.');
  EXPECT_TRUE(shelf.put(1, "a", {}, file, {}).ok());
  EXPECT_TRUE(shelf.put(2, "b", {}, file, {}).ok());
  EXPECT_EQ(shelf.put(3, "c", {}, file, {}).status().code(), base::StatusCode::unavailable);
  EXPECT_EQ(memory.bytes(), 2 * base::world_file_bytes_max);
}

TEST_F(SnapshotShelfTest, AskingForTheSameAgainDoesNotKeepIt) {
  const auto piece = shelf_.put(1, "client", {}, large_file(), {});
  const std::uint64_t id = piece->snapshot_id();
  const TimePoint later = TimePoint() + base::snapshot_timeout;
  EXPECT_TRUE(ask(1, id, 0, later).ok());
  EXPECT_EQ(ask(1, id, 0, later + std::chrono::seconds(1)).status().code(), base::StatusCode::not_found);
}

TEST_F(SnapshotShelfTest, OneThatNobodyAsksForGoes) {
  const auto piece = shelf_.put(1, "client", {}, large_file(), {});
  ASSERT_TRUE(piece.ok());
  const TimePoint asked = TimePoint{} + base::snapshot_timeout;
  EXPECT_TRUE(ask(1, piece->snapshot_id(), 1, asked).ok());
  shelf_.drop_old(asked + base::snapshot_timeout);
  EXPECT_GT(budget_.bytes(), 0U);
  shelf_.drop_old(asked + base::snapshot_timeout + std::chrono::seconds(1));
  EXPECT_EQ(budget_.bytes(), 0U);
}

}  // namespace
}  // namespace pneuma::app
