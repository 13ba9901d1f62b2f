// An explicit step of soft bodies through the lane kernels: bodies of one mesh abreast, or a body alone.
#pragma once

#include <cstdint>
#include <span>

#include "physics/forces/force_terms.h"
#include "physics/lanes/lane_bodies.h"
#include "physics/lanes/lane_kernels.h"
#include "physics/state/substep_context.h"

namespace pneuma::physics {

/// What the kernels need of a body's mesh, and the kernels.
template <class Real>
struct LaneTables {
  const LaneMesh<Real>* mesh = nullptr;
  const LaneKernels<Real>* kernels = nullptr;
};

/// Whether the kernels measure the volume of the body's gas and spread its pressure.
template <class Real>
[[nodiscard]] bool has_lane_gas(const SoftState<Real>& body, const Rings& rings) {
  return body.gas && GasForce::is_in_rings(body, rings);
}

/// One substep of bodies, up to contact: their gas advances (advance_gas), v advances by dt_s, dr is the move that
/// belongs to it, and x stays. A single body, which the context's workers share where it is large; or up to
/// kernels.width of one mesh that are alike as the call begins: all with lane gas or none, all damped or none, all with
/// mass shares or none, the same vertices pinned.
template <class Real>
void step_to_contact(std::span<SoftState<Real>* const> bodies, const LaneTables<Real>& lanes,
                     const SubstepContext& context, LaneScratch<Real>& scratch);

/// As many substeps, x included, of such bodies that touch nothing. Sets `done[i]` where the i-th body has surely
/// stayed within the limits all the way, and its gas just flowed; the others are left as they were, dr aside.
template <class Real>
void step_freely(std::span<SoftState<Real>* const> bodies, const LaneTables<Real>& lanes, const SubstepContext& context,
                 std::uint32_t substeps, LaneScratch<Real>& scratch, std::span<std::uint8_t> done);

}  // namespace pneuma::physics
