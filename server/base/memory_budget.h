// Bytes of memory that are taken of a limit and given back. Any thread.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>

namespace pneuma::base {

class MemoryBudget {
  struct State;

 public:
  explicit MemoryBudget(std::size_t bytes_max) : state_(std::make_shared<State>(bytes_max, nullptr)) {}
  /// A budget that is part of another one: what is taken of it is taken of `whole` too.
  MemoryBudget(std::size_t bytes_max, const MemoryBudget& whole)
      : state_(std::make_shared<State>(bytes_max, whole.state_)) {}

  /// What was taken; it is given back when the share goes, and may outlive the budget.
  class Share {
   public:
    Share() = default;
    Share(Share&& other) noexcept : state_(std::move(other.state_)), bytes_(std::exchange(other.bytes_, 0)) {}
    Share& operator=(Share&& other) noexcept {
      std::swap(state_, other.state_);
      std::swap(bytes_, other.bytes_);
      return *this;
    }
    ~Share() {
      if (state_ != nullptr) state_->give_back(bytes_);
    }

    [[nodiscard]] std::size_t bytes() const { return bytes_; }
    /// Gives back what it has past `bytes`.
    void shrink_to(std::size_t bytes) {
      if (bytes >= bytes_) return;
      state_->give_back(bytes_ - bytes);
      bytes_ = bytes;
    }
    /// Grows to `bytes`, where it has fewer; false where there is no room for that.
    [[nodiscard]] bool grow_to(std::size_t bytes) {
      if (bytes <= bytes_) return true;
      if (state_ == nullptr || !state_->take(bytes - bytes_)) return false;
      bytes_ = bytes;
      return true;
    }

   private:
    friend class MemoryBudget;
    Share(std::shared_ptr<State> state, std::size_t bytes) : state_(std::move(state)), bytes_(bytes) {}

    std::shared_ptr<State> state_;
    std::size_t bytes_ = 0;
  };

  /// Nothing where that would pass the limit of this budget, or of one that it is part of.
  [[nodiscard]] std::optional<Share> take(std::size_t bytes) const {
    if (!state_->take(bytes)) return std::nullopt;
    return Share(state_, bytes);
  }
  /// Past any limit: of what is there already.
  [[nodiscard]] Share take_anyway(std::size_t bytes) const {
    state_->take_anyway(bytes);
    return Share(state_, bytes);
  }

  [[nodiscard]] std::size_t bytes() const { return state_->bytes.load(std::memory_order_relaxed); }
  [[nodiscard]] std::size_t bytes_max() const { return state_->bytes_max; }
  /// What may still be taken, of all that it is part of too.
  [[nodiscard]] std::size_t bytes_left() const {
    std::size_t least = state_->bytes_left();
    for (const State* state = state_->whole.get(); state != nullptr; state = state->whole.get()) {
      least = std::min(least, state->bytes_left());
    }
    return least;
  }
  [[nodiscard]] std::size_t bytes_left_of_its_own() const { return state_->bytes_left(); }

 private:
  struct State {
    State(std::size_t most, std::shared_ptr<State> around) : bytes_max(most), whole(std::move(around)) {}

    [[nodiscard]] std::size_t bytes_left() const { return bytes_max - std::min(bytes_max, bytes.load()); }

    bool take(std::size_t count) {
      std::size_t before = bytes.load(std::memory_order_relaxed);
      do {
        if (before > bytes_max || count > bytes_max - before) return false;
      } while (!bytes.compare_exchange_weak(before, before + count, std::memory_order_relaxed));
      if (whole == nullptr || whole->take(count)) return true;
      bytes.fetch_sub(count, std::memory_order_relaxed);
      return false;
    }
    void take_anyway(std::size_t count) {
      for (State* state = this; state != nullptr; state = state->whole.get()) {
        state->bytes.fetch_add(count, std::memory_order_relaxed);
      }
    }
    void give_back(std::size_t count) {
      for (State* state = this; state != nullptr; state = state->whole.get()) {
        state->bytes.fetch_sub(count, std::memory_order_relaxed);
      }
    }

    const std::size_t bytes_max;
    const std::shared_ptr<State> whole;  // null: it is no part of another one
    std::atomic<std::size_t> bytes = 0;
  };

  std::shared_ptr<State> state_;
};

}  // namespace pneuma::base
