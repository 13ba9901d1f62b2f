// Soft bodies against each other's bounding volumes: the paper's way (section 3.5).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/contact_bounds.h"
#include "physics/scene/shape.h"
#include "physics/scene/shape_entry.h"

namespace pneuma::physics {

/// Appends the vertices of `a` that may touch the bounds of `b` on their way, by index: footnote 4's test.
template <class Real>
void find_near_vertices(const SoftState<Real>& a, const BodyBounds& bounds_a, const SoftState<Real>& b,
                        const BodyBounds& bounds_b, std::vector<std::uint32_t>& near);

struct VertexHit {
  std::uint32_t vertex = 0;
  SurfaceHit hit;                     // about the centre of the bounds, as they are at the end of the substep
  Vec3d impulse_n_s = Vec3d::Zero();  // what it got, once it is answered
};

/// By what a body answers whose vertices hit another's bounds.
enum class HitResponse { vertices, whole };

/// Stops the vertices `near` of `a` at the bounds of `b`. Each meets an equal share of b as a whole (its mass and
/// inertia split among the hits), and b goes on with the mean of its shares: so kinetic energy does not grow where no
/// restitution is past 1, momentum and angular momentum about the places where the substep began are kept to round-off,
/// and the moves that are cut leave the common centre of mass. Pinned vertices hold, and give back nothing. Sets `hits`
/// to those that were met. With HitResponse::whole, `a` too answers by its mean motion: vertices that are stopped after
/// a long step, while the rest of a stiff body runs on, would leave it stretched with energy that nothing paid for.
template <class Real>
void meet_bounds(SoftState<Real>& a, BodyBounds& bounds_a, SoftState<Real>& b, BodyBounds& bounds_b,
                 std::span<const std::uint32_t> near, double resting_m_s, double dt_s, HitResponse response,
                 std::vector<VertexHit>& hits);

}  // namespace pneuma::physics
