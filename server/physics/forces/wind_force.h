// The drag of the air on the faces.
#pragma once

#include <algorithm>

#include "physics/forces/force_term.h"

namespace pneuma::physics {

struct WindForce {
  static constexpr Stage stage = Stage::wind;
  template <class Real>
  [[nodiscard]] static bool is_present(const SoftState<Real>& body, const Surroundings& surroundings) {
    const Drag& drag = body.body.drag;
    return (drag.normal > 0.0 || drag.tangential > 0.0) && surroundings.atmosphere.density_kg_m3 > 0.0;
  }
  template <class Real>
  [[nodiscard]] static bool is_in_rings(const SoftState<Real>&, const Rings&) {
    return false;
  }
  template <class Real>
  [[nodiscard]] static std::size_t bytes(const SoftState<Real>&) {
    return 0;
  }

  template <class Real>
  static void add(SoftState<Real>& body, const ForcePlace<Real>& at, std::span<Vec3<Real>> force);

  static constexpr None potential_j{"the air takes energy, and gives what it has from elsewhere"};

  template <class Real>
  static void linearise(const SoftState<Real>& body, const TangentPlace& at, Tangents& tangents);
  static constexpr None volume_stiffness_pa_m3{"drag does not know the volume"};

  struct Bound {
    double drag_n_s_m3 = 0.0;  // times a vertex's area
    bool operator==(const Bound&) const = default;
    [[nodiscard]] static std::size_t bytes() { return 0; }
  };
  /// Rounded up to a power of two, so that the matrix that depends on it is rarely factored anew.
  template <class Real>
  [[nodiscard]] static Bound bound(const SoftState<Real>& body, const Surroundings& surroundings);
  template <class Real>
  static void stiffen(const SoftState<Real>& body, const Bound& bound, const MatrixPlace& at, MatrixEntries& entries);

  static constexpr None add_to_skin{"the air has no stiffness"};
  static constexpr None rest_volume_stiffness_pa_m3{"drag does not know the volume"};
  /// In a wind of the atmosphere's own speed: the derivative rho C A |u| of 1/2 rho C A u |u|.
  [[nodiscard]] static double drag_at_rest_n_s_m(const SoftBody& body, const Atmosphere& atmosphere, double area_m2) {
    return atmosphere.density_kg_m3 * std::max(body.drag.normal, body.drag.tangential) * area_m2 *
           atmosphere.wind.norm();
  }

  template <class Real>
  struct Xpbd : XpbdNoConstraints, XpbdNoneBetween, XpbdNoDamping {
    std::vector<Vec3<Real>> forces_n;

    /// Drag brings a particle to the wind's speed, however light it is, and not past it.
    void push(const XpbdPlace<Real>& place, std::span<Vec3<Real>> velocities_m_s);
    [[nodiscard]] std::size_t bytes() const { return forces_n.capacity() * sizeof(Vec3<Real>); }
  };

  template <class Real>
  [[nodiscard]] static bool drives(const SoftState<Real>& body, const Surroundings& surroundings) {
    return is_present(body, surroundings);
  }
  /// Still air lets it rest.
  template <class Real>
  [[nodiscard]] static bool keeps_awake(const SoftState<Real>& body, const Surroundings& surroundings) {
    return is_present(body, surroundings) && !surroundings.atmosphere.wind.isZero(0.0);
  }
  template <class Real>
  [[nodiscard]] static bool is_predictable(const SoftState<Real>& body, const Surroundings& surroundings) {
    return !is_present(body, surroundings);
  }
};

}  // namespace pneuma::physics
