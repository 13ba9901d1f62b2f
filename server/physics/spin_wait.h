// How a thread waits for what another is about to do.
#pragma once

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

/// Waits as long as that for `holds`; false if it still does not, and the thread had better sleep.
template <class Condition>
[[nodiscard]] bool comes_soon(const Condition& holds) {
  for (int look = 0; look < looks_before_yield; ++look) {
    if (holds()) return true;
    pause_briefly();
  }
  for (int yield = 0; yield < yields_before_sleep; ++yield) {
    if (holds()) return true;
    std::this_thread::yield();
  }
  return false;
}

}  // namespace pneuma::physics
