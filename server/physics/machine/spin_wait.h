// How a thread waits for what another is about to do.
#pragma once

#include <chrono>
#include <cstddef>
#include <thread>

namespace pneuma::physics {

// The next stage of a step comes within microseconds: it is looked for without leaving the core, some tens of
// microseconds long. The stage after a serial one may take longer, and there may be more threads than cores: yielding
// between looks leaves the core to whoever has work.
inline constexpr int looks_before_yield = 1'000;
inline constexpr int yields_before_sleep = 200;

/// Writing to one thread's must not slow the others down.
inline constexpr std::size_t cache_line_bytes = 64;

inline void pause_briefly() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#else
  std::this_thread::yield();
#endif
}

/// Looks as long as that; false if it still does not hold.
template <class Condition>
[[nodiscard]] bool comes_at_once(const Condition& holds) {
  for (int look = 0; look < looks_before_yield; ++look) {
    if (holds()) return true;
    pause_briefly();
  }
  return false;
}

/// And yields as often as that; false if it still does not, and the thread had better sleep.
template <class Condition>
[[nodiscard]] bool comes_soon(const Condition& holds) {
  if (comes_at_once(holds)) return true;
  for (int yield = 0; yield < yields_before_sleep; ++yield) {
    if (holds()) return true;
    std::this_thread::yield();
  }
  return false;
}

/// Looks and yields until it holds; false if that took longer than `late_after`.
template <class Condition>
[[nodiscard]] bool comes_within(std::chrono::microseconds late_after, const Condition& holds) {
  if (comes_at_once(holds)) return true;
  const auto start = std::chrono::steady_clock::now();
  while (!holds()) std::this_thread::yield();
  return std::chrono::steady_clock::now() - start <= late_after;
}

}  // namespace pneuma::physics
