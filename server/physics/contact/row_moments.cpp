#include "physics/contact/row_moments.h"

#include "physics/rigid/rigid_mass.h"
#include "physics/state/whole_motion.h"

namespace pneuma::physics {

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

template void RowMoments::turn_back(std::span<SoftState<float>>, std::span<RigidState>) const;
template void RowMoments::turn_back(std::span<SoftState<double>>, std::span<RigidState>) const;

}  // namespace pneuma::physics
