// Shows that jobs are done in order, and that no more wait than are allowed to.
#include "app/background_queue.h"

#include <future>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

TEST(BackgroundQueue, PastItsBoundItTakesNoJob) {
  std::promise<void> started;
  std::promise<void> go_on;
  std::vector<int> done;
  BackgroundQueue queue;
  queue.post([&] {
    started.set_value();
    go_on.get_future().wait();
  });
  started.get_future().wait();  // from here on it does not wait, it runs
  EXPECT_TRUE(queue.try_post([&] { done.push_back(1); }, 2));
  EXPECT_TRUE(queue.try_post([&] { done.push_back(2); }, 2));
  EXPECT_FALSE(queue.try_post([&] { done.push_back(3); }, 2));
  go_on.set_value();
  queue.flush();
  EXPECT_EQ(done, (std::vector<int>{1, 2}));
  EXPECT_TRUE(queue.try_post([&] { done.push_back(4); }, 2));
  queue.finish();
  EXPECT_EQ(done, (std::vector<int>{1, 2, 4}));
  EXPECT_FALSE(queue.try_post([&] { done.push_back(5); }, 2));
}

}  // namespace
}  // namespace pneuma::app
