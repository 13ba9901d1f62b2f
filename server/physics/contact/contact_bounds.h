// The boxes that a substep's moves span, and the pairs of bodies that may meet: the paper's first step of detection.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/state/bounds.h"
#include "physics/state/extents.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// What a body's free vertices have of a rigid body: the mean motion of their mass, about the places where the substep
/// began. A hit on the body as a whole changes this part of their motion and leaves the rest, so it costs the energy
/// that it would cost a rigid body, and what it hands over is momentum and angular momentum.
struct RigidPart {
  double mass_kg = 0.0;  // 0: every vertex is pinned
  Vec3d centre = Vec3d::Zero();
  Vec3d velocity = Vec3d::Zero();
  // Of bodies that are hit only (fit_turning).
  bool turning_is_known = false;
  Vec3d angular_velocity = Vec3d::Zero();
  // 0 where the vertices lie on a line: such a body does not turn as a whole.
  Eigen::Matrix3d inverse_inertia_1_kg_m2 = Eigen::Matrix3d::Zero();
};

/// What contact needs to know of a soft body as a whole in this substep.
struct BodyBounds {
  bool active = false;  // not frozen
  bool stale = false;   // its moves were changed since the boxes were fitted
  bool asleep = false;  // the body sleeps, so that the boxes need no other fitting
  Aabb<double> start;   // of x
  Aabb<double> moved;   // of x + dr
  Aabb<double> swept;   // of x and x + dr
  // Filled for bodies of a pair only.
  RigidPart rigid;
  Vec3d mean_move = Vec3d::Zero();  // of the vertices that are not pinned, whatever their mass: of the shape
  Ellipsoid<double> ellipsoid;      // Collision::bounds of the moved vertices: a ball is an ellipsoid of equal radii
};

/// Vertices of `a` are tested against the bounds of `b`.
struct SoftPair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  bool hit = false;  // in this substep
};

template <class Real>
void fit_boxes(const SoftState<Real>& body, BodyBounds& bounds);
/// Likewise where the body's extents are known.
template <class Real>
void fit_boxes(const SoftState<Real>& body, const Extents<Real>& extents, BodyBounds& bounds);
/// Of the centre of mass of the vertices that are not pinned; 0 where all are.
template <class Real>
[[nodiscard]] Vec3d mean_velocity(const SoftState<Real>& body);
/// The mass, the place and the motion of the rigid part, but for its turning.
template <class Real>
void fit_rigid(const SoftState<Real>& body, RigidPart& rigid);
template <class Real>
void fit_means(const SoftState<Real>& body, BodyBounds& bounds);
/// The angular velocity and inertia of the rigid part, from the velocities as they are now; nothing the second time.
template <class Real>
void fit_turning(const SoftState<Real>& body, RigidPart& rigid);

/// Fills `pairs` with both directions of each pair of bodies whose swept boxes, grown by their thickness, overlap; in
/// order of (a, b). Bodies that are not to meet soft bodies are left out, and pairs that both sleep. Sort and sweep
/// along x.
template <class Real>
void find_soft_pairs(std::span<const SoftState<Real>> soft, std::span<const BodyBounds> bounds,
                     std::vector<std::uint32_t>& order, std::vector<SoftPair>& pairs);

}  // namespace pneuma::physics
