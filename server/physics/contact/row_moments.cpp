#include "physics/contact/row_moments.h"

#include <algorithm>

#include "physics/rigid/rigid_mass.h"
#include "physics/state/whole_motion.h"

namespace pneuma::physics {
namespace {

// Of a body that nothing turns: so much that it takes the whole turn of a pair.
constexpr double held_kg_m2 = 1e100;

template <class Real>
double resistance_kg_m2(const SoftState<Real>& state) {
  if (!state.pinned.empty() || !state.is_awake()) return held_kg_m2;
  double mass_kg = 0.0;
  double square_kg_m2 = 0.0;
  Vec3d moment_kg_m = Vec3d::Zero();
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const Vec3d arm = (state.x[i] - state.x[0]).template cast<double>();
    mass_kg += state.mass_kg(i);
    moment_kg_m += state.mass_kg(i) * arm;
    square_kg_m2 += state.mass_kg(i) * arm.squaredNorm();
  }
  return 2.0 * std::max(0.0, square_kg_m2 - moment_kg_m.squaredNorm() / mass_kg);
}

double resistance_kg_m2(const RigidState& state) {
  const Eigen::Matrix3d inverse_1_kg_m2 = inverse_inertia_1_kg_m2(state);
  if (!state.is_awake() || inverse_1_kg_m2.isZero(0.0)) return held_kg_m2;
  return principal_inertia_kg_m2(state.body.shape, state.body.mass_kg).sum();
}

}  // namespace

template <class Real>
void RowMoments::begin(std::span<const SoftState<Real>> soft, std::span<const RigidState> rigid,
                       bool is_first_of_tick) {
  const std::size_t count = soft.size() + rigid.size();
  if (!is_first_of_tick && moments_n_m_s_.size() == count) return;
  moments_n_m_s_.assign(count, Vec3d::Zero());
  inertias_kg_m2_.clear();
  for (const SoftState<Real>& state : soft) inertias_kg_m2_.push_back(resistance_kg_m2(state));
  for (const RigidState& state : rigid) inertias_kg_m2_.push_back(resistance_kg_m2(state));
}

template <class Real>
void RowMoments::turn_back(std::span<SoftState<Real>> soft, std::span<RigidState> rigid) const {
  for (std::size_t i = 0; i < soft.size(); ++i) {
    SoftState<Real>& state = soft[i];
    if (moments_n_m_s_[i].isZero(0.0) || !state.is_awake() || !state.pinned.empty()) continue;
    const auto place = [&](std::size_t k) { return Vec3d((state.x[k] + state.dr[k]).template cast<double>()); };
    const WholeMotion whole = whole_motion(
        state.x.size(), [&](std::size_t k) { return state.mass_kg(k); }, place,
        [](std::size_t) { return Vec3d(Vec3d::Zero()); });
    const Vec3d turn_rad_s = -whole.inverse_inertia_1_kg_m2 * moments_n_m_s_[i];
    for (std::size_t k = 0; k < state.v.size(); ++k) {
      state.v[k] += turn_rad_s.cross(place(k) - whole.centre).template cast<Real>();
    }
  }
  for (std::size_t r = 0; r < rigid.size(); ++r) {
    const Vec3d& moment_n_m_s = moments_n_m_s_[soft.size() + r];
    if (!moment_n_m_s.isZero(0.0) && rigid[r].is_awake())
      rigid[r].angular_velocity -= inverse_inertia_1_kg_m2(rigid[r]) * moment_n_m_s;
  }
}

template void RowMoments::begin(std::span<const SoftState<float>>, std::span<const RigidState>, bool);
template void RowMoments::begin(std::span<const SoftState<double>>, std::span<const RigidState>, bool);
template void RowMoments::turn_back(std::span<SoftState<float>>, std::span<RigidState>) const;
template void RowMoments::turn_back(std::span<SoftState<double>>, std::span<RigidState>) const;

}  // namespace pneuma::physics
