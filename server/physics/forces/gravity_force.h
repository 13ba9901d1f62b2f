// Gravity: the same acceleration everywhere.
#pragma once

#include "physics/forces/force_term.h"

namespace pneuma::physics {

struct GravityForce {
  static constexpr Stage stage = Stage::integrate;
  template <class Real>
  [[nodiscard]] static bool is_present(const SoftState<Real>&, const Surroundings& surroundings) {
    return !surroundings.gravity.isZero(0.0);
  }
  template <class Real>
  [[nodiscard]] static bool is_in_rings(const SoftState<Real>&, const Rings&) {
    return true;
  }
  template <class Real>
  [[nodiscard]] static std::size_t bytes(const SoftState<Real>&) {
    return 0;
  }

  static constexpr None add{"an acceleration is added where velocities advance"};

  template <class Real>
  [[nodiscard]] static double potential_j(const SoftState<Real>& body, const EnergyPlace& at,
                                          const Surroundings& surroundings) {
    Vec3d sum_m = static_cast<double>(at.x.size()) * at.origin_m;
    body.with_mass_shares([&](auto share) {
      for (std::size_t i = 0; i < at.x.size(); ++i) sum_m += share(i) * at.x[i];
    });
    return -(static_cast<double>(body.vertex_mass_kg) * surroundings.gravity.dot(sum_m));
  }
  static constexpr double BodyMeasures::* measure = &BodyMeasures::gravity_j;

  static constexpr None linearise{"a force that is the same everywhere has no derivative"};
  static constexpr None volume_stiffness_pa_m3{"gravity does not know the volume"};
  static constexpr None stiffen{"nothing to bound"};

  static constexpr None add_to_skin{"a force that is the same everywhere makes nothing swing"};
  static constexpr None rest_volume_stiffness_pa_m3{"gravity does not know the volume"};
  static constexpr None drag_at_rest_n_s_m{"it damps nothing"};

  template <class Real>
  struct Xpbd : XpbdNoConstraints, XpbdNoneBetween, XpbdNoDamping, XpbdNoRoom {
    static void push(const XpbdPlace<Real>& place, std::span<Vec3<Real>> velocities_m_s) {
      const Vec3<Real> fall = static_cast<Real>(place.h_s) * place.surroundings.gravity.template cast<Real>();
      for (Vec3<Real>& velocity : velocities_m_s) velocity += fall;
    }
  };

  /// The body falls as a whole, and so freely.
  template <class Real>
  [[nodiscard]] static bool drives(const SoftState<Real>&, const Surroundings&) {
    return false;
  }
  template <class Real>
  [[nodiscard]] static bool keeps_awake(const SoftState<Real>&, const Surroundings&) {
    return false;
  }
  template <class Real>
  [[nodiscard]] static bool is_predictable(const SoftState<Real>&, const Surroundings&) {
    return true;
  }
};

}  // namespace pneuma::physics
