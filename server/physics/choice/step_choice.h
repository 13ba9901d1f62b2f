// Which integrator steps a scene, and how long a step it may take, from the scene's stiffness.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "physics/choice/stability.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

/// As the scene format has it: "SYMPLECTIC_EULER".
[[nodiscard]] std::string_view name_of(Integrator integrator);

/// Of a body that an implicit step solves for together with its contacts: what a row costs there grows with the
/// vertices, and past this many a substep took minutes. Larger bodies answer by the masses of their vertices, after the
/// step.
inline constexpr std::size_t coupled_vertices_max = 4'096;

struct SubstepChoice {
  std::uint32_t substeps = 1;
  Integrator integrator = Integrator::midpoint;  // never `automatic`
  std::string reason;
  /// Of implicit Euler: what nothing holds falls as it does in nature. That is so where its contacts are met within the
  /// step.
  bool falls_by_parabola = false;
  /// One a soft body: Frequencies::gas_give_m4_kg. A gas that is pressed is stiffer than the substeps were chosen for,
  /// and more of them are taken then. Empty where the scene gives the number of substeps, or the method has no limit.
  std::vector<double> gas_give_m4_kg = {};
};

/// The integrator and the number of substeps that a scene asks for or leaves open.
/// Steps are chosen to hold every body's breathing (longest_step_s), its fall by its own length and, at the spin it
/// begins with, its turn by a radian within the error target.
/// AUTO is the method that meets every body's longest step at the least cost in force evaluations, within the substeps
/// that the scene gives or substeps_max; where none does, the cheapest that is stable. Where bodies can touch anything
/// the passes that an implicit step takes at contact are part of its cost.
/// Substeps of 0 are the fewest that satisfy every body. Given ones at which an explicit integrator is unstable are
/// refused with the limit, raised or allowed, as stepping.on_unstable says. Fails where more than substeps_max would be
/// needed, naming the body.
[[nodiscard]] base::Result<SubstepChoice> choose_substeps(const Scene& scene, FrequencyTable& known);

}  // namespace pneuma::physics
