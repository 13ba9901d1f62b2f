// Shows that what is taken of a budget never passes its limit, nor that of the budget around it, from any number of
// threads, and that all of it comes back.
#include "base/memory_budget.h"

#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::base {
namespace {

TEST(MemoryBudget, GivesNoMoreThanItHas) {
  const MemoryBudget budget(100);
  auto most = budget.take(60);
  ASSERT_TRUE(most);
  EXPECT_FALSE(budget.take(41));
  EXPECT_TRUE(budget.take(40));
  most.reset();
  EXPECT_EQ(budget.bytes(), 0U);
  EXPECT_FALSE(budget.take(101));
}

TEST(MemoryBudget, APartIsTakenOfTheWhole) {
  const MemoryBudget whole(100);
  const MemoryBudget one(80, whole);
  const MemoryBudget other(80, whole);
  const auto share = one.take(70);
  ASSERT_TRUE(share);
  EXPECT_FALSE(other.take(40)) << "the whole has 30 left";
  EXPECT_EQ(other.bytes(), 0U);
  EXPECT_TRUE(other.take(30));
  EXPECT_FALSE(one.take(20)) << "the part has 10 left";
}

TEST(MemoryBudget, AShareMovesGrowsAndOutlivesItsBudget) {
  MemoryBudget::Share kept;
  const MemoryBudget whole(100);
  {
    const MemoryBudget part(50, whole);
    MemoryBudget::Share share = std::move(*part.take(10));
    EXPECT_TRUE(share.grow_to(50));
    EXPECT_FALSE(share.grow_to(51));
    EXPECT_TRUE(share.grow_to(20)) << "it never shrinks";
    EXPECT_EQ(share.bytes(), 50U);
    kept = std::move(share);
  }
  EXPECT_EQ(whole.bytes(), 50U);
  kept = {};
  EXPECT_EQ(whole.bytes(), 0U);
}

TEST(MemoryBudget, WhatIsThereAlreadyCountsPastTheLimit) {
  const MemoryBudget budget(100);
  {
    const auto share = budget.take_anyway(150);
    EXPECT_EQ(budget.bytes(), 150U);
    EXPECT_FALSE(budget.take(0)) << "it is past its limit";
  }
  EXPECT_TRUE(budget.take(100));
}

TEST(MemoryBudget, ThreadsTakeNoMoreThanThereIsTogether) {
  const MemoryBudget whole(1'000);
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&whole] {
      const MemoryBudget part(700, whole);
      for (int round = 0; round < 20'000; ++round) {
        const auto share = part.take(400);
        EXPECT_LE(whole.bytes(), 1'000U);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(whole.bytes(), 0U);
}

}  // namespace
}  // namespace pneuma::base
