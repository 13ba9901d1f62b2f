#include "app/share_queue.h"

#include <algorithm>
#include <tuple>

namespace pneuma::app {

bool ShareQueue::EarlierDue::operator()(const SharerPtr& a, const SharerPtr& b) const {
  return std::tie(a->due_, a->sequence_) < std::tie(b->due_, b->sequence_);
}

bool ShareQueue::EarlierStart::operator()(const SharerPtr& a, const SharerPtr& b) const {
  return std::tie(a->start_, a->due_, a->sequence_) < std::tie(b->start_, b->due_, b->sequence_);
}

void ShareQueue::add(const SharerPtr& sharer, TimePoint due) {
  sharer->due_ = due;
  sharer->sequence_ = ++sequence_;
  sharer->is_ready_ = false;
  waiting_.insert(sharer);
}

void ShareQueue::remove(const SharerPtr& sharer) {
  sharer->is_ready_ ? ready_of(*sharer).erase(sharer) : waiting_.erase(sharer);
}

void ShareQueue::collect(TimePoint now) {
  while (!waiting_.empty() && (*waiting_.begin())->due_ <= now) {
    SharerPtr sharer = waiting_.extract(waiting_.begin()).value();
    sharer->start_ = std::max(level_ - saved_max, sharer->had_);
    sharer->is_ready_ = true;
    sharer->is_brief_ = now >= sharer->brief_from_;
    ready_of(*sharer).insert(std::move(sharer));
  }
  // Who waits for long may come to count as brief meanwhile.
  for (auto it = long_.begin(); it != long_.end();) {
    const SharerPtr sharer = *it++;
    if (now < sharer->brief_from_) continue;
    long_.erase(sharer);
    sharer->is_brief_ = true;
    brief_.insert(sharer);
  }
}

ShareQueue::Ready* ShareQueue::first_ready() {
  if (brief_.empty() && long_.empty()) return nullptr;
  if (brief_.empty()) return &long_;
  return long_.empty() || EarlierStart()(*brief_.begin(), *long_.begin()) ? &brief_ : &long_;
}

ShareQueue::SharerPtr ShareQueue::take_from(Ready& ready) {
  SharerPtr sharer = ready.extract(ready.begin()).value();
  sharer->is_ready_ = false;
  level_ = std::max(level_, sharer->start_);
  return sharer;
}

ShareQueue::SharerPtr ShareQueue::take(TimePoint now) {
  collect(now);
  Ready* const first = first_ready();
  return first == nullptr ? nullptr : take_from(*first);
}

ShareQueue::SharerPtr ShareQueue::take_brief(TimePoint now) {
  collect(now);
  return brief_.empty() ? nullptr : take_from(brief_);
}

void ShareQueue::used(Sharer& sharer, Duration time, TimePoint now) {
  sharer.had_ = sharer.start_ + time;
  if (time > brief_max) sharer.brief_from_ = now + remembered;
}

bool ShareQueue::has_before(const Sharer& running, Duration used, TimePoint now) {
  collect(now);
  const Ready* const first = first_ready();
  return first != nullptr && (*first->begin())->start_ <= running.start_ + used;
}

std::optional<ShareQueue::TimePoint> ShareQueue::next_due() const {
  std::optional<TimePoint> first;
  const auto take = [&first](const auto& queue) {
    if (!queue.empty()) first = first ? std::min(*first, (*queue.begin())->due_) : (*queue.begin())->due_;
  };
  take(waiting_);
  take(brief_);
  take(long_);
  return first;
}

std::optional<ShareQueue::TimePoint> ShareQueue::next_brief_due(TimePoint now) {
  collect(now);
  if (!brief_.empty()) return (*brief_.begin())->due_;
  if (!waiting_.empty()) return (*waiting_.begin())->due_;
  return std::nullopt;
}

}  // namespace pneuma::app
