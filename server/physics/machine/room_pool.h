// Scratch that worlds use in turns: each needs it within a tick only, and few worlds are within one at once.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace pneuma::physics {

/// A pool lends so many rooms of a kind, and keeps none that has grown larger. So what worlds hold besides their own
/// needs, since others used a room before, is bounded.
inline constexpr std::size_t pooled_rooms_max = 16;
inline constexpr std::size_t pooled_room_bytes_max = std::size_t{4} * 1024 * 1024;

/// A room to work in, lent by a pool of the process where it is first asked for. Where the pool has lent all, the room
/// is a new one. A copy has none. What is in a room that was lent is of whoever had it last.
/// Room has `std::size_t bytes() const`, and `void clear()`, which lets go of what is others'.
template <class Room>
class Borrowed {
 public:
  Borrowed() = default;
  Borrowed(const Borrowed& /*other*/) {}
  Borrowed(Borrowed&& other) noexcept : room_(std::move(other.room_)), is_lent_(std::exchange(other.is_lent_, false)) {}
  Borrowed& operator=(Borrowed other) noexcept {
    std::swap(room_, other.room_);
    std::swap(is_lent_, other.is_lent_);
    return *this;
  }
  ~Borrowed() {
    if (is_lent_) Pool::of_process().forget();
  }

  [[nodiscard]] Room& operator*() {
    if (room_ == nullptr) is_lent_ = Pool::of_process().lend(room_);
    return *room_;
  }
  [[nodiscard]] Room* operator->() { return &**this; }
  /// Null where none is held.
  [[nodiscard]] const Room* held() const { return room_.get(); }

  /// At a tick's end. A room that has grown too large for the pool is the world's own from here on, unless it has more
  /// bytes than the world may keep; a smaller one that was not lent is freed.
  void give_back(std::size_t kept_bytes_max = std::numeric_limits<std::size_t>::max()) {
    if (room_ == nullptr) return;
    const std::size_t bytes = room_->bytes();
    const bool is_large = bytes > pooled_room_bytes_max && bytes <= kept_bytes_max;
    if (bytes > pooled_room_bytes_max && !is_large) *room_ = Room();
    if (std::exchange(is_lent_, false)) {
      if (is_large) return Pool::of_process().forget();
      room_->clear();
      return Pool::of_process().take_back(std::move(room_));
    }
    if (!is_large) room_.reset();
  }

 private:
  class Pool {
   public:
    // Never destroyed, since worlds may outlive it at the program's end.
    static Pool& of_process() {
      static Pool& pool = *new Pool;
      return pool;
    }
    // Sets the room. Whether it is one of the pool's.
    bool lend(std::unique_ptr<Room>& room) {
      const std::lock_guard lock(mutex_);
      if (!free_.empty()) {
        room = std::move(free_.back());
        free_.pop_back();
        return true;
      }
      room = std::make_unique<Room>();
      if (count_ == pooled_rooms_max) return false;
      ++count_;
      return true;
    }
    void take_back(std::unique_ptr<Room> room) {
      const std::lock_guard lock(mutex_);
      free_.push_back(std::move(room));
    }
    // A room that was lent does not come back.
    void forget() {
      const std::lock_guard lock(mutex_);
      --count_;
    }

   private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<Room>> free_;
    std::size_t count_ = 0;  // of those that are free or lent
  };

  std::unique_ptr<Room> room_;
  bool is_lent_ = false;
};

}  // namespace pneuma::physics
