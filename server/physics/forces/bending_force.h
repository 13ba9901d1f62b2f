// Bending: springs on the angles between neighbouring faces (mesh/hinge.h).
#pragma once

#include "physics/forces/force_term.h"

namespace pneuma::physics {

struct BendingForce {
  static constexpr Stage stage = Stage::bending;
  template <class Real>
  [[nodiscard]] static bool is_present(const SoftState<Real>& body, const Surroundings&) {
    return !body.hinges.empty();
  }
  template <class Real>
  [[nodiscard]] static bool is_in_rings(const SoftState<Real>&, const Rings&) {
    return false;
  }
  template <class Real>
  [[nodiscard]] static std::size_t bytes(const SoftState<Real>& body) {
    return body.hinges.capacity() * sizeof(Hinge);
  }

  template <class Real>
  static void add(SoftState<Real>& body, const ForcePlace<Real>& at, std::span<Vec3<Real>> force);

  template <class Real>
  [[nodiscard]] static double potential_j(const SoftState<Real>& body, const EnergyPlace& at, const Surroundings&);
  static constexpr double BodyMeasures::* measure = &BodyMeasures::elastic_j;

  template <class Real>
  static void linearise(const SoftState<Real>& body, const TangentPlace& at, Tangents& tangents);
  static constexpr None volume_stiffness_pa_m3{"angles do not know the volume"};

  struct Bound {
    double bend_stiffness_n_m = 0.0;
    bool operator==(const Bound&) const = default;
    [[nodiscard]] static std::size_t bytes() { return 0; }
  };
  template <class Real>
  [[nodiscard]] static Bound bound(const SoftState<Real>& body, const Surroundings&) {
    return {body.body.springs.bend_stiffness_n_m};
  }
  template <class Real>
  static void stiffen(const SoftState<Real>& body, const Bound& bound, const MatrixPlace& at, MatrixEntries& entries);

  static void add_to_skin(const Mesh& mesh, const Springs& springs, SkinMotion& skin);
  static constexpr None rest_volume_stiffness_pa_m3{"angles do not know the volume"};
  static constexpr None drag_at_rest_n_s_m{"nothing damps it"};

  /// One constraint a hinge.
  template <class Real>
  struct Xpbd : XpbdNoPush, XpbdNoneBetween, XpbdNoDamping {
    std::vector<double> turns;  // h^2 times the moment

    void begin(const XpbdPlace<Real>& place) { turns.assign(place.body.hinges.size(), 0.0); }
    void pass(const XpbdPlace<Real>& place, XpbdWay way);
    [[nodiscard]] std::size_t bytes() const { return turns.capacity() * sizeof(double); }
  };

  template <class Real>
  [[nodiscard]] static bool drives(const SoftState<Real>&, const Surroundings&) {
    return false;
  }
  template <class Real>
  [[nodiscard]] static bool keeps_awake(const SoftState<Real>&, const Surroundings&) {
    return false;
  }
  template <class Real>
  [[nodiscard]] static bool is_predictable(const SoftState<Real>& body, const Surroundings&) {
    return !(body.body.springs.bend_stiffness_n_m > 0.0);
  }
};

}  // namespace pneuma::physics
