// Shows that the pool runs each item once, whatever the counts of threads and items, and leaves the caller only when
// all are done.
#include "physics/machine/workers.h"

#include <atomic>
#include <numeric>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::physics {
namespace {

class WorkersOfEachCount : public testing::TestWithParam<std::size_t> {};

TEST_P(WorkersOfEachCount, RunsEveryItemOnce) {
  Workers workers(GetParam());
  EXPECT_EQ(workers.threads(), GetParam());
  for (const std::size_t count : {0U, 1U, 2U, 3U, 100U, 1000U}) {
    std::vector<int> calls(count, 0);  // not atomic: each item belongs to one call, and the return orders it before us
    workers.for_each(count, [&](std::size_t i) { ++calls[i]; });
    EXPECT_EQ(calls, std::vector<int>(count, 1));
  }
}

TEST_P(WorkersOfEachCount, CarriesManyShortRoundsOneAfterAnother) {
  Workers workers(GetParam());
  std::vector<std::size_t> sums(7, 0);
  for (std::size_t round = 0; round < 2000; ++round) {
    workers.for_each(sums.size(), [&](std::size_t i) { sums[i] += i + round; });
  }
  const std::size_t rounds_sum = 2000 * 1999 / 2;
  for (std::size_t i = 0; i < sums.size(); ++i) EXPECT_EQ(sums[i], 2000 * i + rounds_sum);
}

INSTANTIATE_TEST_SUITE_P(Threads, WorkersOfEachCount, testing::Values(1, 2, 3, 8));

TEST(Workers, RunsInlineWithOneThread) {
  Workers workers(1);
  const std::thread::id here = std::this_thread::get_id();
  workers.for_each(5, [&](std::size_t) { EXPECT_EQ(std::this_thread::get_id(), here); });
}

TEST(Workers, ItemsOfOneRoundRunAtTheSameTime) {
  // Two items that wait for each other end only on two threads.
  Workers workers(2);
  std::atomic<int> arrived{0};
  workers.for_each(2, [&](std::size_t) {
    arrived.fetch_add(1);
    while (arrived.load() < 2) std::this_thread::yield();
  });
  EXPECT_EQ(arrived.load(), 2);
}

TEST(Workers, MayBeMadeAndEndedInsideAnItemOfOthers) {
  Workers outer(3);
  std::vector<std::size_t> sums(6, 0);
  outer.for_each(sums.size(), [&](std::size_t i) {
    Workers inner(2);
    std::vector<std::size_t> parts(10, 0);
    inner.for_each(parts.size(), [&](std::size_t j) { parts[j] = j; });
    sums[i] = std::accumulate(parts.begin(), parts.end(), std::size_t{0});
  });
  EXPECT_EQ(sums, std::vector<std::size_t>(6, 45));
}

TEST(Workers, EndAtOnceWhenTheyNeverWorked) {
  for (int i = 0; i < 50; ++i) const Workers idle(4);
}

}  // namespace
}  // namespace pneuma::physics
