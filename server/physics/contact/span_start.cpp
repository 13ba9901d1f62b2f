#include "physics/contact/span_start.h"

#include <algorithm>

namespace pneuma::physics {
namespace {

// To a copy and back: both name these alike.
template <class From, class To>
void copy_soft(const From& from, To& to) {
  to.x = from.x;
  to.v = from.v;
  to.gas = from.gas;
  to.volume_m3 = from.volume_m3;
  to.pressure_pa = from.pressure_pa;
  to.inverted = from.inverted;
}

template <class From, class To>
void copy_rigid(const From& from, To& to) {
  to.position = from.position;
  to.orientation = from.orientation;
  to.velocity = from.velocity;
  to.angular_velocity = from.angular_velocity;
  to.has_moved = from.has_moved;
}

}  // namespace

template <class Real>
void SpanStart<Real>::keep(const Moving<Real>& moving, std::uint32_t substeps_left) {
  substeps_left_ = substeps_left;
  events_ = moving.events;
  soft_.resize(std::max(soft_.size(), moving.soft.size()));
  for (std::size_t i = 0; i < moving.soft.size(); ++i) {
    soft_[i].is_awake = moving.soft[i].is_awake();
    if (soft_[i].is_awake) copy_soft(moving.soft[i], soft_[i]);
  }
  rigid_.resize(moving.rigid.size());
  for (std::size_t i = 0; i < moving.rigid.size(); ++i) {
    rigid_[i].is_awake = moving.rigid[i].is_awake();
    copy_rigid(moving.rigid[i], rigid_[i]);
  }
  colliders_.clear();
  for (const ColliderState& state : moving.colliders) colliders_.push_back({state.position, state.orientation});
  if (moving.touches != nullptr) touches_ = *moving.touches;
}

template <class Real>
bool SpanStart<Real>::can_restore(const Moving<Real>& moving) const {
  if (substeps_left_ == 0 || events_ != moving.events) return false;
  for (std::size_t i = 0; i < moving.soft.size(); ++i) {
    if (moving.soft[i].is_awake() != soft_[i].is_awake || moving.soft[i].is_crowded) return false;
  }
  for (std::size_t i = 0; i < moving.rigid.size(); ++i) {
    if (moving.rigid[i].is_awake() != rigid_[i].is_awake || moving.rigid[i].is_crowded) return false;
  }
  return true;
}

template <class Real>
void SpanStart<Real>::restore(const Moving<Real>& moving) const {
  for (std::size_t i = 0; i < moving.soft.size(); ++i) {
    if (soft_[i].is_awake) copy_soft(soft_[i], moving.soft[i]);
  }
  for (std::size_t i = 0; i < moving.rigid.size(); ++i) copy_rigid(rigid_[i], moving.rigid[i]);
  for (std::size_t i = 0; i < moving.colliders.size(); ++i) {
    moving.colliders[i].position = colliders_[i].position;
    moving.colliders[i].orientation = colliders_[i].orientation;
  }
  if (moving.touches != nullptr) *moving.touches = touches_;
}

template <class Real>
std::size_t SpanStart<Real>::bytes() const {
  std::size_t sum = soft_.capacity() * sizeof(Soft) + rigid_.capacity() * sizeof(Rigid) +
                    colliders_.capacity() * sizeof(Pose) + touches_.bytes();
  for (const Soft& kept : soft_) sum += (kept.x.capacity() + kept.v.capacity()) * sizeof(Vec3<Real>);
  return sum;
}

template class SpanStart<float>;
template class SpanStart<double>;

}  // namespace pneuma::physics
