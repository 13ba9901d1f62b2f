#include "physics/machine/workers.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "physics/machine/spin_wait.h"

namespace pneuma::physics {

// A round is cut into a share of neighbouring items for each thread. A thread takes its own items first, then what is
// left of others', so that a thread that comes late, or not at all, is not waited for. Nobody joins a round: who has
// taken an item holds the round open until he has reported it, and so may read what the round is about.
struct Workers::Pool {
  struct alignas(cache_line_bytes) Share {
    std::atomic<std::size_t> left{0};  // items that nobody has taken: the last ones of the share
    std::size_t end = 0;               // the item after the share's last one
    const std::function<void(std::size_t)>* work = nullptr;
  };

  explicit Pool(std::size_t helper_count) : shares(helper_count + 1) {
    helpers.reserve(helper_count);
    for (std::size_t i = 0; i < helper_count; ++i) helpers.emplace_back([this, i] { help(i + 1); });
  }

  ~Pool() {
    {
      const std::lock_guard lock(mutex);
      stopping = true;
    }
    begun.notify_all();
    for (std::thread& helper : helpers) helper.join();
  }

  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  void run(std::size_t count, const std::function<void(std::size_t)>& item_work) {
    assert(!running && "for_each is not re-entrant");
    running = true;
    reported.store(0, std::memory_order_relaxed);
    std::size_t begin = 0;
    for (std::size_t i = 0; i < shares.size(); ++i) {  // the caller's, who has more to do, is the smallest
      shares[i].end = (i + 1) * count / shares.size();
      shares[i].work = &item_work;
      shares[i].left.store(shares[i].end - begin);
      begin = shares[i].end;
    }
    // Of a helper that goes to sleep, either this sees that, or it sees the items: both are sequentially consistent.
    if (sleepers.load() != 0) {
      {
        const std::lock_guard lock(mutex);
      }
      begun.notify_all();
    }
    const std::size_t of_helpers = count - take_items(0);
    const auto all_reported = [&] { return reported.load() == of_helpers; };
    if (!comes_soon(all_reported)) {
      std::unique_lock lock(mutex);
      caller_sleeps.store(true);
      ended.wait(lock, all_reported);
      caller_sleeps.store(false);
    }
    running = false;
  }

  void help(std::size_t thread) {
    // Also of others: one who has come late into a round may have taken an item of this thread's, and wait within it
    // for the one that he left.
    const auto has_items = [&] {
      return std::ranges::any_of(shares, [](const Share& share) { return share.left.load() != 0; });
    };
    for (;;) {
      if (!comes_soon(has_items)) {
        std::unique_lock lock(mutex);
        sleepers.fetch_add(1);
        begun.wait(lock, [&] { return stopping || has_items(); });
        sleepers.fetch_sub(1);
        if (stopping) return;
      }
      const std::size_t taken = take_items(thread);
      if (taken == 0) continue;
      reported.fetch_add(taken);
      if (caller_sleeps.load()) {
        {
          const std::lock_guard lock(mutex);
        }
        ended.notify_one();
      }
    }
  }

  // Runs items until none is left to take; returns how many.
  std::size_t take_items(std::size_t thread) {
    std::size_t taken = 0;
    for (std::size_t i = 0; i < shares.size(); ++i) {
      Share& share = shares[(thread + i) % shares.size()];
      std::size_t left = share.left.load(std::memory_order_acquire);
      while (left != 0) {
        if (!share.left.compare_exchange_weak(left, left - 1, std::memory_order_acquire)) continue;
        (*share.work)(share.end - left);
        ++taken;
        left = share.left.load(std::memory_order_acquire);
      }
    }
    return taken;
  }

  std::vector<Share> shares;                                       // the caller's first
  bool running = false;                                            // a round, for the caller only
  alignas(cache_line_bytes) std::atomic<std::size_t> reported{0};  // items done by helpers
  std::atomic<std::size_t> sleepers{0};
  std::atomic<bool> caller_sleeps{false};
  std::mutex mutex;  // of the conditions, and of `stopping`
  std::condition_variable begun;
  std::condition_variable ended;
  bool stopping = false;
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
