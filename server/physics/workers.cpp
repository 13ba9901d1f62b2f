#include "physics/workers.h"

#include <atomic>
#include <cassert>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

namespace pneuma::physics {
namespace {

// A thread looks this often before it sleeps: the next stage of a step comes within microseconds, the next tick in
// milliseconds. Yielding between looks leaves the core to whoever has work.
constexpr int looks_before_sleep = 200;

}  // namespace

struct Workers::Pool {
  explicit Pool(std::size_t helper_count) {
    helpers.reserve(helper_count);
    for (std::size_t i = 0; i < helper_count; ++i) helpers.emplace_back([this] { help(); });
  }

  ~Pool() {
    {
      const std::lock_guard lock(mutex);
      stopping = true;
      round.fetch_add(1, std::memory_order_release);
    }
    begun.notify_all();
    for (std::thread& helper : helpers) helper.join();
  }

  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  void run(std::size_t item_count, const std::function<void(std::size_t)>& item_work) {
    {
      const std::lock_guard lock(mutex);
      assert(work == nullptr && "for_each is not re-entrant");
      work = &item_work;
      count = item_count;
      next.store(0, std::memory_order_relaxed);
      round.fetch_add(1, std::memory_order_release);
    }
    begun.notify_all();
    take_items(item_work, item_count);
    for (int look = 0; look < looks_before_sleep && busy.load(std::memory_order_acquire) != 0; ++look) {
      std::this_thread::yield();
    }
    std::unique_lock lock(mutex);
    work = nullptr;  // a helper that wakes from here on finds nothing to join
    ended.wait(lock, [this] { return busy.load(std::memory_order_relaxed) == 0; });
  }

  void help() {
    std::uint64_t seen = 0;
    for (;;) {
      for (int look = 0; look < looks_before_sleep && round.load(std::memory_order_acquire) == seen; ++look) {
        std::this_thread::yield();
      }
      std::unique_lock lock(mutex);
      begun.wait(lock, [&] { return round.load(std::memory_order_relaxed) != seen; });
      if (stopping) return;
      seen = round.load(std::memory_order_relaxed);
      if (work == nullptr) continue;
      const std::function<void(std::size_t)>& item_work = *work;
      const std::size_t item_count = count;
      busy.fetch_add(1, std::memory_order_relaxed);
      lock.unlock();
      take_items(item_work, item_count);
      lock.lock();
      if (busy.fetch_sub(1, std::memory_order_release) == 1) ended.notify_one();
    }
  }

  void take_items(const std::function<void(std::size_t)>& item_work, std::size_t item_count) {
    for (std::size_t i = next.fetch_add(1, std::memory_order_relaxed); i < item_count;
         i = next.fetch_add(1, std::memory_order_relaxed)) {
      item_work(i);
    }
  }

  // Written under the mutex; the atomics are also looked at without it.
  std::mutex mutex;
  std::condition_variable begun;
  std::condition_variable ended;
  const std::function<void(std::size_t)>* work = nullptr;  // null between rounds
  std::size_t count = 0;
  bool stopping = false;
  std::atomic<std::uint64_t> round{0};
  std::atomic<std::size_t> busy{0};  // helpers that joined the round
  std::atomic<std::size_t> next{0};  // the next item that nobody has
  std::vector<std::thread> helpers;
};

Workers::Workers(std::size_t threads) : pool_(threads > 1 ? std::make_unique<Pool>(threads - 1) : nullptr) {
  assert(threads >= 1);
}

Workers::~Workers() = default;

void Workers::for_each(std::size_t count, const std::function<void(std::size_t)>& work) {
  if (pool_ == nullptr || count < 2) {
    for (std::size_t i = 0; i < count; ++i) work(i);
    return;
  }
  pool_->run(count, work);
}

std::size_t Workers::threads() const {
  return pool_ == nullptr ? 1 : pool_->helpers.size() + 1;
}

}  // namespace pneuma::physics
