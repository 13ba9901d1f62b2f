// Room for numbers that vector registers load.
#pragma once

#include <cstddef>
#include <new>
#include <utility>

namespace pneuma::physics {

/// Puts an array at the start of a cache line, so that no load of a lane crosses one.
template <class T>
struct LineAllocator {
  using value_type = T;
  static constexpr std::align_val_t line{64};

  LineAllocator() = default;
  template <class U>
  explicit LineAllocator(const LineAllocator<U>&) {}
  /// Leaves numbers as they come, so that those a thread never looks at take no memory.
  template <class U>
  void construct(U* at) {
    ::new (static_cast<void*>(at)) U;
  }
  template <class U, class... Arguments>
  void construct(U* at, Arguments&&... arguments) {
    ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
  }
  [[nodiscard]] T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), line)); }
  void deallocate(T* at, std::size_t) { ::operator delete(at, line); }
  bool operator==(const LineAllocator&) const = default;
};
}  // namespace pneuma::physics
