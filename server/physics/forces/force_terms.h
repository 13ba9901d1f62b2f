// The list of the forces on soft bodies, and what the engine asks of all of them. A new force is a file of its own and
// a name in this list.
#pragma once

#include "physics/forces/bending_force.h"
#include "physics/forces/force_term.h"
#include "physics/forces/gas_force.h"
#include "physics/forces/grab_force.h"
#include "physics/forces/gravity_force.h"
#include "physics/forces/spring_force.h"
#include "physics/forces/wind_force.h"

namespace pneuma::physics {

template <ForceTerm... Terms>
struct ForceList {
  /// Calls work.operator()<Term>() for each, in this order.
  template <class Work>
  static void for_each(const Work& work) {
    (work.template operator()<Terms>(), ...);
  }
  /// Whether asks.operator()<Term>() says yes for any.
  template <class Asks>
  [[nodiscard]] static bool any(const Asks& asks) {
    return (asks.template operator()<Terms>() || ...);
  }
};

/// Forces are added up in this order, and so are energies: it is part of the bits.
using ForceTerms = ForceList<SpringForce, BendingForce, GravityForce, GasForce, WindForce, GrabForce>;

/// Whether the body has forces that the lane kernels do not know. Such a body steps alone.
template <class Real>
[[nodiscard]] bool has_other_forces(const SoftState<Real>& body, const Rings& rings, const Surroundings& surroundings) {
  return ForceTerms::any(
      [&]<class Term>() { return Term::is_present(body, surroundings) && !Term::is_in_rings(body, rings); });
}

/// Adds these to `force` (N, one a vertex). With no rings, all but those that only the kernels know.
template <class Real>
void add_other_forces(SoftState<Real>& body, const ForcePlace<Real>& at, const Rings* rings,
                      std::span<Vec3<Real>> force) {
  ForceTerms::for_each([&]<class Term>() {
    if constexpr (!term_parts::NoAdding<Term>) {
      if (rings != nullptr && Term::is_in_rings(body, *rings)) return;
      if (Term::is_present(body, at.surroundings)) Term::add(body, at, force);
    }
  });
}

/// Whether anything beside contact and joints moves or holds the body otherwise than as a free one.
template <class Real>
[[nodiscard]] bool is_driven(const SoftState<Real>& body, const Surroundings& surroundings) {
  return !body.pinned.empty() || ForceTerms::any([&]<class Term>() { return Term::drives(body, surroundings); });
}

/// Whether a force lets the body rest never.
template <class Real>
[[nodiscard]] bool is_kept_awake(const SoftState<Real>& body, const Surroundings& surroundings) {
  return ForceTerms::any([&]<class Term>() { return Term::keeps_awake(body, surroundings); });
}

/// Whether readers of a stream know all of the body's forces.
template <class Real>
[[nodiscard]] bool is_predictable(const SoftState<Real>& body, const Surroundings& surroundings) {
  return !ForceTerms::any([&]<class Term>() { return !Term::is_predictable(body, surroundings); });
}

/// All tangents but those on the diagonal and along the volume's gradient.
template <class Real>
void linearise(const SoftState<Real>& body, const TangentPlace& at, Tangents& tangents) {
  tangents.clear(*body.body.mesh);
  ForceTerms::for_each([&]<class Term>() {
    if constexpr (!term_parts::NoTangent<Term>) Term::linearise(body, at, tangents);
  });
}

/// The tangent along the volume's gradient, at the body's volume: -dP/dV.
template <class Real>
[[nodiscard]] double volume_stiffness_pa_m3(const SoftState<Real>& body) {
  double sum = 0.0;
  ForceTerms::for_each([&]<class Term>() {
    if constexpr (!term_parts::NoVolumeStiffness<Term>) sum += Term::volume_stiffness_pa_m3(body);
  });
  return sum;
}

}  // namespace pneuma::physics
