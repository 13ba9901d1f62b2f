// Who goes next of those that share threads. Pure; the time is passed in.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>

namespace pneuma::app {

/// Start-time fair queueing (Goyal, Vin and Cheng, 1996). Who is due goes in the order of the processor time that each
/// has had: one that uses less than its share goes before all that would use more, and what it leaves is theirs. Who
/// comes back after a rest is before those that went on meanwhile, but by `saved_max` at most. Of equals the one that
/// was due first goes first.
class ShareQueue {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  /// Longer than a slice: a slice under way is ahead of those that wait by as much.
  static constexpr Duration saved_max = std::chrono::milliseconds(10);

  /// Who holds its processor for longer at a time is not brief, and counts as such for so long.
  static constexpr Duration brief_max = std::chrono::milliseconds(5);
  static constexpr Duration remembered = std::chrono::seconds(10);

  class Sharer {
    friend class ShareQueue;
    TimePoint due_{};
    std::uint64_t sequence_ = 0;  // of equal due times, who has waited longer goes first
    bool is_ready_ = false;       // due, and in the order of shares
    bool is_brief_ = true;        // while it is ready
    TimePoint brief_from_{};
    Duration start_{};  // what it had had when its turn came, on the scale that all share
    Duration had_{};    // with what it has used since
  };
  using SharerPtr = std::shared_ptr<Sharer>;

  /// Waits until it is due; in the queue once at most.
  void add(const SharerPtr& sharer, TimePoint due);
  void remove(const SharerPtr& sharer);

  [[nodiscard]] std::size_t size() const { return waiting_.size() + brief_.size() + long_.size(); }

  /// The next of those due by `now`, which leaves the queue; null where there is none.
  [[nodiscard]] SharerPtr take(TimePoint now);
  /// The same of the brief ones.
  [[nodiscard]] SharerPtr take_brief(TimePoint now);
  /// What one that was taken has used of a processor, until `now`.
  static void used(Sharer& sharer, Duration time, TimePoint now);

  /// Somebody waits who was due by `now` and has had no more than `running`, with the time that it has used since it
  /// was taken.
  [[nodiscard]] bool has_before(const Sharer& running, Duration used, TimePoint now);
  /// When somebody is due first; nothing where nobody waits.
  [[nodiscard]] std::optional<TimePoint> next_due() const;
  /// The same of the brief ones; or earlier, where it is not known yet whether one is.
  [[nodiscard]] std::optional<TimePoint> next_brief_due(TimePoint now);

 private:
  struct EarlierDue {
    bool operator()(const SharerPtr& a, const SharerPtr& b) const;
  };
  struct EarlierStart {
    bool operator()(const SharerPtr& a, const SharerPtr& b) const;
  };

  using Ready = std::set<SharerPtr, EarlierStart>;

  void collect(TimePoint now);
  [[nodiscard]] SharerPtr take_from(Ready& ready);
  [[nodiscard]] Ready& ready_of(const Sharer& sharer) { return sharer.is_brief_ ? brief_ : long_; }
  /// Null where nobody is ready.
  [[nodiscard]] Ready* first_ready();

  std::set<SharerPtr, EarlierDue> waiting_;
  Ready brief_, long_;
  std::uint64_t sequence_ = 0;
  Duration level_{};  // the largest start of those that were taken
};

}  // namespace pneuma::app
