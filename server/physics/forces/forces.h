// The forces on a soft body's particles: steps 1 to 3 of the paper's algorithm (section 2.4).
#pragma once

#include <span>

#include "physics/state/state.h"
#include "physics/state/substep_context.h"

namespace pneuma::physics {

/// The body's volume at positions `x`, by its own method. That of a body that is not flat is greater than 0 by every
/// method, but for one turned inside out: by those that follow the skin it is not (gas.h takes it from there).
template <class Real>
[[nodiscard]] double body_volume_m3(const SoftBody& body, std::span<const Vec3<Real>> x);

/// Adds to `force` (N, one a particle) what the lane kernels do not know, at positions `x` and velocities `v`: bending,
/// wind, grabs, and pressure where `with_gas`, which sets the body's volume and pressure to what they are there. `dt_s`
/// bounds how stiff a grab may be.
template <class Real>
void add_other_forces(SoftState<Real>& body, std::span<const Vec3<Real>> x, std::span<const Vec3<Real>> v,
                      const Surroundings& surroundings, double dt_s, bool with_gas, std::span<Vec3<Real>> force,
                      Profile* profile);

/// Whether the air acts on the body.
[[nodiscard]] bool has_wind(const SoftBody& body, const Atmosphere& atmosphere);

/// Adds the force of the air alone.
template <class Real>
void add_wind(const SoftBody& body, const Atmosphere& atmosphere, std::span<const Vec3<Real>> x,
              std::span<const Vec3<Real>> v, std::span<Vec3<Real>> force);

/// Adds the pressure force alone: P A n of each face shared to its three particles, or the paper's spread by vertex
/// normals. Of `body` only its scratch changes; a second call allocates nothing.
template <class Real>
void add_pressure(SoftState<Real>& body, double pressure_pa, std::span<const Vec3<Real>> x,
                  std::span<Vec3<Real>> force);

}  // namespace pneuma::physics
