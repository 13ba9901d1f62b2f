// How long a step an explicit integrator may take, from a scene's stiffness.
#pragma once

#include <string>

#include "base/status.h"
#include "physics/scene.h"

namespace pneuma::physics {

/// The fastest and the breathing motion of a body at rest.
struct Frequencies {
  double fastest_rad_s = 0.0;      // square root of the largest eigenvalue of M^-1 K, springs and gas
  double fastest_decay_1_s = 0.0;  // largest eigenvalue of M^-1 D: the decay of motion by spring damping and wind
  double breathing_rad_s = 0.0;    // Rayleigh quotient of uniform scaling
};

/// By power iteration on the rest shape's linearised springs and the gas's rank-one term (g P / V) gradV gradV^T.
/// Drag counts as it is in a wind of the atmosphere's own speed.
[[nodiscard]] Frequencies estimate_frequencies(const SoftBody& body, const Atmosphere& atmosphere);

/// The longest step that keeps a motion of these frequencies from growing (see the source for each method's condition),
/// and the breathing motion's phase within error_target a period.
[[nodiscard]] double longest_step_s(Integrator integrator, const Frequencies& frequencies, double error_target);

struct SubstepChoice {
  std::uint32_t substeps = 1;
  std::string reason;
};

/// The scene's own number of substeps, or, where that is 0, the smallest that satisfies every body. Fails where more
/// than substeps_max would be needed, naming the body.
[[nodiscard]] base::Result<SubstepChoice> choose_substeps(const Scene& scene);

}  // namespace pneuma::physics
