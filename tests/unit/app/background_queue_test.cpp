// Shows that jobs are done in order, and that no more wait than are allowed to.
#include "app/background_queue.h"

#include <future>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

TEST(BackgroundQueue, PastItsBoundItTakesNoJob) {
  constexpr BackgroundQueue::Room two{2, 100};
  std::promise<void> started;
  std::promise<void> go_on;
  std::vector<int> done;
  BackgroundQueue queue;
  queue.post([&] {
    started.set_value();
    go_on.get_future().wait();
  });
  started.get_future().wait();  // from here on it does not wait, it runs
  EXPECT_TRUE(queue.try_post([&] { done.push_back(1); }, 0, two));
  EXPECT_TRUE(queue.try_post([&] { done.push_back(2); }, 0, two));
  EXPECT_FALSE(queue.try_post([&] { done.push_back(3); }, 0, two));
  go_on.set_value();
  queue.flush();
  EXPECT_EQ(done, (std::vector<int>{1, 2}));
  EXPECT_TRUE(queue.try_post([&] { done.push_back(4); }, 0, two));
  queue.finish();
  EXPECT_EQ(done, (std::vector<int>{1, 2, 4}));
  EXPECT_FALSE(queue.try_post([&] { done.push_back(5); }, 0, two));
}

TEST(BackgroundQueue, PastItsBytesItTakesNoJobThatHoldsSome) {
  constexpr BackgroundQueue::Room room{10, 100};
  std::promise<void> started;
  std::promise<void> go_on;
  BackgroundQueue queue;
  queue.post([&] {
    started.set_value();
    go_on.get_future().wait();
  });
  started.get_future().wait();
  EXPECT_TRUE(queue.try_post([] {}, 60, room));
  EXPECT_FALSE(queue.try_post([] {}, 41, room));
  EXPECT_TRUE(queue.try_post([] {}, 40, room));
  EXPECT_TRUE(queue.try_post([] {}, 0, room));
  go_on.set_value();
  queue.flush();
  EXPECT_TRUE(queue.try_post([] {}, 100, room)) << "what is done gives its room back";
}

}  // namespace
}  // namespace pneuma::app
