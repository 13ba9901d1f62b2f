#include "physics/contact/span_start.h"

#include <algorithm>

namespace pneuma::physics {

template <class Real>
void SpanStart<Real>::keep(const Moving<Real>& moving, std::uint32_t substeps_left) {
  substeps_left_ = substeps_left;
  events_ = moving.events;
  soft_.resize(std::max(soft_.size(), moving.soft.size()));
  for (std::size_t i = 0; i < moving.soft.size(); ++i) {
    const SoftState<Real>& state = moving.soft[i];
    Soft& kept = soft_[i];
    kept.is_awake = state.is_awake();
    if (!kept.is_awake) continue;
    kept.x = state.x;
    kept.v = state.v;
    kept.gas = state.gas;
    kept.volume_m3 = state.volume_m3;
    kept.pressure_pa = state.pressure_pa;
    kept.inverted = state.inverted;
  }
  rigid_.clear();
  for (const RigidState& state : moving.rigid) {
    rigid_.push_back(
        {state.is_awake(), state.position, state.orientation, state.velocity, state.angular_velocity, state.has_moved});
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
    SoftState<Real>& state = moving.soft[i];
    const Soft& kept = soft_[i];
    if (!kept.is_awake) continue;
    state.x = kept.x;
    state.v = kept.v;
    state.gas = kept.gas;
    state.volume_m3 = kept.volume_m3;
    state.pressure_pa = kept.pressure_pa;
    state.inverted = kept.inverted;
  }
  for (std::size_t i = 0; i < moving.rigid.size(); ++i) {
    RigidState& state = moving.rigid[i];
    const Rigid& kept = rigid_[i];
    state.position = kept.position;
    state.orientation = kept.orientation;
    state.velocity = kept.velocity;
    state.angular_velocity = kept.angular_velocity;
    state.has_moved = kept.has_moved;
  }
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
