// Hands that hold vertices: damped springs to moving points.
#pragma once

#include "physics/forces/force_term.h"

namespace pneuma::physics {

struct GrabForce {
  static constexpr Stage stage = Stage::grabs;
  template <class Real>
  [[nodiscard]] static bool is_present(const SoftState<Real>& body, const Surroundings&) {
    return !body.grabs.empty();
  }
  template <class Real>
  [[nodiscard]] static bool is_in_rings(const SoftState<Real>&, const Rings&) {
    return false;
  }
  template <class Real>
  [[nodiscard]] static std::size_t bytes(const SoftState<Real>& body) {
    return body.grabs.capacity() * sizeof(Grab);
  }

  template <class Real>
  static void add(SoftState<Real>& body, const ForcePlace<Real>& at, std::span<Vec3<Real>> force);

  static constexpr None potential_j{"a hand gives and takes energy as it moves"};

  static constexpr None linearise{"stiffen has all of it: a hand holds a vertex alike along every axis"};
  static constexpr None volume_stiffness_pa_m3{"hands do not know the volume"};

  struct Bound {
    std::vector<double> holds;  // vertex, stiffness and damping of each
    bool operator==(const Bound&) const = default;
    [[nodiscard]] std::size_t bytes() const { return holds.capacity() * sizeof(double); }
  };
  template <class Real>
  [[nodiscard]] static Bound bound(const SoftState<Real>& body, const Surroundings&) {
    Bound bound;
    for (const Grab& grab : body.grabs) {
      bound.holds.insert(bound.holds.end(), {static_cast<double>(grab.vertex), grab.stiffness_n_m, grab.damping_n_s_m});
    }
    return bound;
  }
  template <class Real>
  static void stiffen(const SoftState<Real>& body, const Bound&, const MatrixPlace& at, MatrixEntries& entries) {
    for (const Grab& grab : body.grabs) {
      entries.diagonal[grab.vertex] += at.s * (grab.damping_n_s_m + at.s * grab.stiffness_n_m);
    }
  }

  static constexpr None add_to_skin{"a hand comes later; explicit steps bound how stiff it may be"};
  static constexpr None rest_volume_stiffness_pa_m3{"hands do not know the volume"};
  static constexpr None drag_at_rest_n_s_m{"a hand comes later; explicit steps bound how much it damps"};

  /// One constraint a hand.
  template <class Real>
  struct Xpbd : XpbdNoPush, XpbdNoneBetween, XpbdNoDamping {
    std::vector<Vec3d> pulls;  // h^2 times the force

    void begin(const XpbdPlace<Real>& place) { pulls.assign(place.body.grabs.size(), Vec3d::Zero()); }
    void pass(const XpbdPlace<Real>& place, XpbdWay way);
    [[nodiscard]] std::size_t bytes() const { return pulls.capacity() * sizeof(Vec3d); }
  };

  template <class Real>
  [[nodiscard]] static bool drives(const SoftState<Real>& body, const Surroundings& surroundings) {
    return is_present(body, surroundings);
  }
  template <class Real>
  [[nodiscard]] static bool keeps_awake(const SoftState<Real>& body, const Surroundings& surroundings) {
    return is_present(body, surroundings);
  }
  /// A hand comes and goes faster than readers are told of mechanics: the writer sees by its residuals what it does.
  template <class Real>
  [[nodiscard]] static bool is_predictable(const SoftState<Real>&, const Surroundings&) {
    return true;
  }
};

}  // namespace pneuma::physics
