// A soft body's sums at one instant: energies, momenta, volume. In double, whatever the body steps in.
#pragma once

#include <span>

#include "physics/forces/body_measures.h"
#include "physics/forces/force_term.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// What all forces hold with the body's particles at `at`, as BodyMeasures counts it.
template <class Real>
[[nodiscard]] double potential_j(const SoftState<Real>& state, const EnergyPlace& at, const Surroundings& surroundings);

/// Without the area and the potential energies, which are 0 in it: half of the work.
template <class Real>
[[nodiscard]] BodyMeasures measure_motion(const SoftState<Real>& state, double outside_pressure_pa);

/// `Real` is float or double.
template <class Real>
[[nodiscard]] BodyMeasures measure(const SoftState<Real>& state, double outside_pressure_pa, const Vec3d& gravity_m_s2);

}  // namespace pneuma::physics
