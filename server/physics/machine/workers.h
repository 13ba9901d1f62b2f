// A small fork-join pool: runs the same function over an index range, results independent of the thread count.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace pneuma::physics {

class Workers {
 public:
  /// `threads` counts the caller; 1 runs everything inline and starts no thread.
  explicit Workers(std::size_t threads);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// Calls work(i) for every i in [0, count), each once, in any order and on any thread; returns when all are done.
  /// `work` writes only to what belongs to its index. Where no thread is late, rounds of one count have each index on
  /// the same thread, which then has in its cache what belongs to it; neighbouring indices mostly share one. Up to
  /// threads() items are all under way at once in the end, so that these may wait for each other.
  void for_each(std::size_t count, const std::function<void(std::size_t)>& work);

  [[nodiscard]] std::size_t threads() const;

 private:
  struct Pool;
  std::unique_ptr<Pool> pool_;
};

}  // namespace pneuma::physics
