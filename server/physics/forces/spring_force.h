// Springs along the edges, with their damping.
#pragma once

#include "physics/forces/force_term.h"

namespace pneuma::physics {

struct SpringForce {
  static constexpr Stage stage = Stage::springs;
  template <class Real>
  [[nodiscard]] static bool is_present(const SoftState<Real>& body, const Surroundings&) {
    return body.body.springs.stiffness_n_m > 0.0 || body.body.springs.damping_n_s_m > 0.0;
  }
  template <class Real>
  [[nodiscard]] static bool is_in_rings(const SoftState<Real>&, const Rings&) {
    return true;
  }
  template <class Real>
  [[nodiscard]] static std::size_t bytes(const SoftState<Real>&) {
    return 0;  // the lanes' tables are a mesh's
  }

  static constexpr None add{"every method takes springs from the lane kernels"};

  template <class Real>
  [[nodiscard]] static double potential_j(const SoftState<Real>& body, const EnergyPlace& at, const Surroundings&);
  static constexpr double BodyMeasures::* measure = &BodyMeasures::elastic_j;

  template <class Real>
  static void linearise(const SoftState<Real>& body, const TangentPlace& at, Tangents& tangents);
  static constexpr None volume_stiffness_pa_m3{"springs do not know the volume"};

  struct Bound {
    double stiffness_n_m = 0.0;
    double damping_n_s_m = 0.0;
    std::vector<double> vertex_stiffness_scale;
    bool operator==(const Bound&) const = default;
    [[nodiscard]] std::size_t bytes() const { return vertex_stiffness_scale.capacity() * sizeof(double); }
  };
  template <class Real>
  [[nodiscard]] static Bound bound(const SoftState<Real>& body, const Surroundings&) {
    const Springs& springs = body.body.springs;
    return {springs.stiffness_n_m, springs.damping_n_s_m, springs.vertex_stiffness_scale};
  }
  /// (s d + s^2 k) L with the graph Laplacian L, weighted where springs differ, which is never less than the tangent.
  template <class Real>
  static void stiffen(const SoftState<Real>& body, const Bound& bound, const MatrixPlace& at, MatrixEntries& entries);

  static void add_to_skin(const Mesh&, const Springs& springs, SkinMotion& skin);
  static constexpr None rest_volume_stiffness_pa_m3{"springs do not know the volume"};
  static constexpr None drag_at_rest_n_s_m{"their damping is in the skin"};

  /// One constraint an edge. Damping comes after the move: in one constraint with the spring, as XPBD's paper has it, a
  /// damping with h d / m far past 1 takes the springs' share of the pass and leaves the gas's, and the body grows.
  template <class Real>
  struct Xpbd : XpbdNoPush, XpbdNoneBetween {
    std::vector<Real> pulls;  // h^2 times the force, over the length

    void begin(const XpbdPlace<Real>& place);
    void pass(const XpbdPlace<Real>& place, XpbdWay way);
    void damp(const XpbdPlace<Real>& place) const;
    [[nodiscard]] std::size_t bytes() const { return pulls.capacity() * sizeof(Real); }
  };

  template <class Real>
  [[nodiscard]] static bool drives(const SoftState<Real>&, const Surroundings&) {
    return false;
  }
  /// A body without damping may go on for ever.
  template <class Real>
  [[nodiscard]] static bool keeps_awake(const SoftState<Real>& body, const Surroundings&) {
    return !(body.body.springs.damping_n_s_m > 0.0);
  }
  template <class Real>
  [[nodiscard]] static bool is_predictable(const SoftState<Real>&, const Surroundings&) {
    return true;
  }
};

}  // namespace pneuma::physics
