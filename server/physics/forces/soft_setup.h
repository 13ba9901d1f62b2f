// From a scene's soft body to its live state, and from an edited one to the state it goes on with.
#pragma once

#include "physics/state/state.h"

namespace pneuma::physics {

/// The body at its place in the scene, moving as the scene says.
template <class Real>
[[nodiscard]] SoftState<Real> make_soft_state(const SoftBody& body);

/// Whether `state` can go on as `body`: the same mesh, put into the scene the same way.
[[nodiscard]] bool continues(const SoftBody& before, const SoftBody& after);

/// Gives a live body another mass, springs, gas, pins and so on; it goes on from where it is. `state.body.gas` holds
/// the live amounts on entry, and only what differs from them in `body` is set.
template <class Real>
void change_soft_state(SoftState<Real>& state, const SoftBody& body);

/// The body as the scene would have to say it now: its gas as it is.
template <class Real>
[[nodiscard]] SoftBody live_body(const SoftState<Real>& state);

}  // namespace pneuma::physics
