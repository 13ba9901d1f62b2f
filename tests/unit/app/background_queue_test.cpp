// Shows that jobs are done in order and takers in turn, and that no more wait than are allowed to.
#include "app/background_queue.h"

#include <future>
#include <string>
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

/// Busy until it goes.
class Held {
 public:
  explicit Held(BackgroundQueue& queue) {
    std::promise<void> started;
    queue.post([&, go_on = go_on_.get_future().share()] {
      started.set_value();
      go_on.wait();
    });
    started.get_future().wait();
  }
  ~Held() { go_on_.set_value(); }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;

 private:
  std::promise<void> go_on_;
};

TEST(BackgroundQueue, TakersHaveTheirTurns) {
  std::string done;
  BackgroundQueue queue;
  {
    const Held held(queue);
    for (const char job : std::string("abc")) queue.post([&done, job] { done += job; }, "many");
    for (const char job : std::string("12")) queue.post([&done, job] { done += job; }, "few");
    queue.post([&done] { done += '.'; });
  }
  queue.flush();
  EXPECT_EQ(done, "a1.b2c");
}

TEST(BackgroundQueue, ATakerLeavesHalfTheRoomToOthers) {
  constexpr BackgroundQueue::Room room{4, 100};
  BackgroundQueue queue;
  const Held held(queue);
  EXPECT_TRUE(queue.try_post([] {}, 30, room, "a"));
  EXPECT_FALSE(queue.try_post([] {}, 21, room, "a"));
  EXPECT_TRUE(queue.try_post([] {}, 20, room, "a"));
  EXPECT_FALSE(queue.try_post([] {}, 0, room, "a")) << "two of four wait";
  EXPECT_TRUE(queue.try_post([] {}, 50, room, "b")) << "one alone may be as large as there is room";
  EXPECT_FALSE(queue.try_post([] {}, 1, room, "c"));
  EXPECT_TRUE(queue.try_post([] {}, 0, room, "c"));
}

}  // namespace
}  // namespace pneuma::app
