// Shows who goes next, on a simulated machine: whoever keeps within its share is late by no more than what is under
// way, whoever else is; and those that want more than there is get the same.
#include "app/share_queue.h"

#include <algorithm>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

using Duration = ShareQueue::Duration;
using TimePoint = ShareQueue::TimePoint;
using std::chrono::microseconds;
using std::chrono::milliseconds;

/// Wants so much time each period, and gives its processor up after so much of it.
struct Wish {
  Duration period{};
  Duration work{};
  Duration slice = milliseconds(2);
};

struct Life : ShareQueue::Sharer {
  explicit Life(const Wish& asked) : wish(asked), left(asked.work) {}
  Wish wish;
  Duration left{};
  TimePoint due{};
  TimePoint ends{};  // of the slice under way
  Duration slice{};
  Duration had{};
  Duration most_late{};  // from when it was due to the first slice, once all have begun
  bool mid_tick = false;
};

constexpr TimePoint all_have_begun{std::chrono::seconds(1)};

/// Lets all of them run on so many processors.
std::vector<std::shared_ptr<Life>> live_on(int processors, const std::vector<Wish>& wishes, Duration span) {
  ShareQueue queue;
  std::vector<std::shared_ptr<Life>> lives;
  for (const Wish& wish : wishes) queue.add(lives.emplace_back(std::make_shared<Life>(wish)), TimePoint{});
  std::vector<std::shared_ptr<Life>> under_way;
  TimePoint now{};
  while (now < TimePoint{} + span) {
    while (static_cast<int>(under_way.size()) < processors) {
      const auto life = std::static_pointer_cast<Life>(queue.take(now));
      if (life == nullptr) break;
      if (!life->mid_tick && now > all_have_begun) life->most_late = std::max(life->most_late, now - life->due);
      life->mid_tick = true;
      life->slice = std::min(life->left, life->wish.slice);
      life->ends = now + life->slice;
      under_way.push_back(life);
    }
    const auto first = std::ranges::min_element(under_way, {}, [](const auto& life) { return life->ends; });
    const auto due = queue.next_due();
    const bool waits = due && static_cast<int>(under_way.size()) < processors;
    if (first == under_way.end() || (waits && *due < (*first)->ends)) {
      now = *due;
      continue;
    }
    const std::shared_ptr<Life> life = *first;
    under_way.erase(first);
    now = life->ends;
    life->had += life->slice;
    life->left -= life->slice;
    ShareQueue::used(*life, life->slice, now);
    if (life->left > Duration::zero()) {
      queue.add(life, now);
      continue;
    }
    life->mid_tick = false;
    life->left = life->wish.work;
    life->due = std::max(life->due + life->wish.period, now - milliseconds(100));  // as a world's clock has it
    queue.add(life, life->due);
  }
  return lives;
}

constexpr Wish overloaded{milliseconds(5), milliseconds(50)};
constexpr Wish light{milliseconds(16), milliseconds(1)};

TEST(ShareQueue, WhoKeepsWithinItsShareIsNotLateWhoeverElseIs) {
  for (const int processors : {1, 2, 3}) {
    for (const std::size_t others : {1U, 8U, 16U, 100U}) {
      std::vector<Wish> wishes(others, overloaded);
      // Of a hundred, each may have 0.16 ms in 16.
      wishes.push_back({light.period, others == 100U ? Duration(microseconds(100)) : light.work / 2});
      const auto lives = live_on(processors, wishes, std::chrono::seconds(3));
      EXPECT_LE(lives.back()->most_late, overloaded.slice) << processors << " processors, " << others << " others";
    }
  }
}

TEST(ShareQueue, OneThatHoldsItsProcessorForLongHasItsNextTurnLate) {
  const auto lives = live_on(1, {{milliseconds(5), milliseconds(500), milliseconds(500)}, overloaded, overloaded},
                             std::chrono::seconds(30));
  for (const auto& life : lives) EXPECT_NEAR(static_cast<double>(life->had / milliseconds(1)), 10'000.0, 500.0);
}

TEST(ShareQueue, WhatIsLeftIsSharedEvenly) {
  std::vector<Wish> wishes(5, overloaded);
  wishes.insert(wishes.end(), 3, light);
  for (const int processors : {1, 2}) {
    const auto lives = live_on(processors, wishes, std::chrono::seconds(10));
    const Duration rest = processors * std::chrono::seconds(10) - 3 * lives.back()->had;
    for (const auto& life : lives) {
      const bool is_light = life->wish.work == light.work;
      const Duration fair = is_light ? Duration(std::chrono::seconds(10)) / 16 : rest / 5;
      EXPECT_NEAR(static_cast<double>(life->had / microseconds(1)), static_cast<double>(fair / microseconds(1)),
                  0.01 * static_cast<double>(fair / microseconds(1)));
    }
  }
}

// Any mix: who wants no more than an even part of all gets all that it wants.
TEST(ShareQueue, NobodyIsKeptFromItsShareByAMixOfOthers) {
  std::mt19937 random(18);
  for (int round = 0; round < 50; ++round) {
    const int processors = 1 + static_cast<int>(random() % 3);
    const auto count = 2 + random() % 20;
    std::vector<Wish> wishes;
    for (std::size_t i = 0; i < count; ++i) {
      const Duration period = milliseconds(5 + random() % 40);
      const Duration work =
          std::chrono::duration_cast<Duration>((0.02 + static_cast<double>(random() % 150) / 100.0) * period);
      wishes.push_back({period, work, microseconds(200 + random() % 4'000)});
    }
    const Duration span = std::chrono::seconds(20);
    const double share = std::min(1.0, static_cast<double>(processors) / static_cast<double>(count));
    for (const auto& life : live_on(processors, wishes, span)) {
      const double wanted =
          static_cast<double>(life->wish.work.count()) / static_cast<double>(life->wish.period.count());
      const double got = static_cast<double>(life->had.count()) / static_cast<double>(span.count());
      EXPECT_GE(got, 0.97 * std::min(wanted, share)) << "round " << round << ", of " << count;
    }
  }
}

TEST(ShareQueue, OfEqualsTheFirstDueGoesFirst) {
  ShareQueue queue;
  std::vector<ShareQueue::SharerPtr> sharers;
  for (int i = 0; i < 3; ++i) {
    queue.add(sharers.emplace_back(std::make_shared<ShareQueue::Sharer>()), TimePoint{} + milliseconds(3 - i));
  }
  EXPECT_EQ(queue.take(TimePoint{}), nullptr);
  EXPECT_EQ(queue.next_due(), TimePoint{} + milliseconds(1));
  for (const std::size_t i : {2U, 1U, 0U}) EXPECT_EQ(queue.take(TimePoint{} + milliseconds(3)), sharers.at(i));
  EXPECT_EQ(queue.next_due(), std::nullopt);
}

TEST(ShareQueue, OneThatUsedLessIsBeforeWhoIsUnderWay) {
  ShareQueue queue;
  const auto heavy = std::make_shared<ShareQueue::Sharer>();
  const auto other = std::make_shared<ShareQueue::Sharer>();
  queue.add(heavy, TimePoint{});
  EXPECT_EQ(queue.take(TimePoint{}), heavy);
  EXPECT_FALSE(queue.has_before(*heavy, milliseconds(9), TimePoint{}));
  queue.add(other, TimePoint{});
  EXPECT_TRUE(queue.has_before(*heavy, milliseconds(9), TimePoint{}));
  EXPECT_EQ(queue.take(TimePoint{}), other);
  ShareQueue::used(*other, milliseconds(10), TimePoint{});
  queue.add(other, TimePoint{});
  EXPECT_FALSE(queue.has_before(*heavy, milliseconds(9), TimePoint{}));
  queue.remove(other);
  EXPECT_EQ(queue.next_due(), std::nullopt);
}

TEST(ShareQueue, WhoHeldAProcessorForLongIsNotBriefForAWhile) {
  ShareQueue queue;
  const auto brief = std::make_shared<ShareQueue::Sharer>();
  const auto lengthy = std::make_shared<ShareQueue::Sharer>();
  TimePoint now{};
  for (const auto& [sharer, time] : {std::pair(brief, milliseconds(4)), std::pair(lengthy, milliseconds(6))}) {
    queue.add(sharer, now);
    ASSERT_EQ(queue.take_brief(now), sharer);
    ShareQueue::used(*sharer, time, now);
    queue.add(sharer, now);
  }
  EXPECT_EQ(queue.next_brief_due(now), now);
  EXPECT_EQ(queue.take_brief(now), brief);
  EXPECT_EQ(queue.next_brief_due(now), std::nullopt);
  EXPECT_EQ(queue.take_brief(now), nullptr);
  EXPECT_EQ(queue.take(now), lengthy);
  ShareQueue::used(*lengthy, milliseconds(1), now);
  now += ShareQueue::remembered;
  queue.add(lengthy, now);
  EXPECT_EQ(queue.take_brief(now), lengthy);
}

TEST(ShareQueue, WhoIsBriefAgainWhileItWaitsIsTakenAsSuch) {
  ShareQueue queue;
  const auto sharer = std::make_shared<ShareQueue::Sharer>();
  const TimePoint now{};
  queue.add(sharer, now);
  ASSERT_EQ(queue.take(now), sharer);
  ShareQueue::used(*sharer, milliseconds(6), now);
  queue.add(sharer, now);
  EXPECT_EQ(queue.take_brief(now), nullptr);
  EXPECT_EQ(queue.take_brief(now + ShareQueue::remembered), sharer);
}

}  // namespace
}  // namespace pneuma::app
