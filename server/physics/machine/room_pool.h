// Room to work in that worlds use in turns: it is needed within a tick, and there are few ticks at once.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace pneuma::physics {

/// Of a room: one that has grown larger stays with its world, since the pool would hold it for worlds that need little.
inline constexpr std::size_t pooled_room_bytes_max = std::size_t{8} * 1024 * 1024;

/// Room that is taken from a pool of the process where it is first asked for, and given back by `give_back`. A copy, or
/// what was moved from, has none. What is in a room that was taken is of whoever had it last.
/// Room has `std::size_t bytes() const` and `void clear()`, which lets go of what is others'.
template <class Room>
class Borrowed {
 public:
  Borrowed() = default;
  Borrowed(const Borrowed& /*other*/) {}
  Borrowed& operator=(const Borrowed& /*other*/) {
    room_.reset();
    return *this;
  }
  Borrowed(Borrowed&&) noexcept = default;
  Borrowed& operator=(Borrowed&&) noexcept = default;
  ~Borrowed() = default;

  [[nodiscard]] Room& operator*() {
    if (room_ == nullptr) room_ = Pool::of_process().take();
    return *room_;
  }
  [[nodiscard]] Room* operator->() { return &**this; }
  /// Null where none is held.
  [[nodiscard]] const Room* held() const { return room_.get(); }

  /// Unless it has grown too large.
  void give_back() {
    if (room_ == nullptr || room_->bytes() > pooled_room_bytes_max) return;
    room_->clear();
    Pool::of_process().put(std::move(room_));
  }

  /// Of all rooms that nobody has.
  [[nodiscard]] static std::size_t pooled_bytes() { return Pool::of_process().bytes(); }

 private:
  static constexpr std::size_t pooled_rooms_max = 16;

  class Pool {
   public:
    // Never destroyed, since worlds may outlive it at the program's end.
    static Pool& of_process() {
      static Pool& pool = *new Pool;
      return pool;
    }
    std::unique_ptr<Room> take() {
      const std::lock_guard lock(mutex_);
      if (free_.empty()) return std::make_unique<Room>();
      std::unique_ptr<Room> room = std::move(free_.back());
      free_.pop_back();
      return room;
    }
    std::size_t bytes() {
      const std::lock_guard lock(mutex_);
      std::size_t sum = 0;
      for (const std::unique_ptr<Room>& room : free_) sum += room->bytes();
      return sum;
    }
    void put(std::unique_ptr<Room> room) {
      const std::lock_guard lock(mutex_);
      if (free_.size() < pooled_rooms_max) free_.push_back(std::move(room));
    }

   private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<Room>> free_;
  };

  std::unique_ptr<Room> room_;
};

}  // namespace pneuma::physics
