// The boxes that a substep's moves span, and the pairs of bodies that may meet: the paper's first step of detection.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/bounds.h"
#include "physics/state.h"

namespace pneuma::physics {

/// What contact needs to know of a soft body as a whole in this substep.
struct BodyBounds {
  bool active = false;  // not frozen
  bool stale = false;   // its moves were changed since the boxes were fitted
  bool asleep = false;  // the body sleeps, so that the boxes need no other fitting
  Aabb<double> moved;   // of x + dr
  Aabb<double> swept;   // of x and x + dr
  // Of the vertices that are not pinned; filled for bodies of a pair only.
  double free_mass_kg = 0.0;
  Vec3d mean_velocity = Vec3d::Zero();
  Vec3d mean_move = Vec3d::Zero();
  Ellipsoid<double> ellipsoid;  // Collision::bounds of the moved vertices: a ball is an ellipsoid of equal radii
  // What the vertices of other bodies that hit it give back, in sum.
  Vec3d impulse_n_s = Vec3d::Zero();
  Vec3d shift_kg_m = Vec3d::Zero();  // mass times displacement
  bool hit = false;
};

/// Vertices of `a` are tested against the bounds of `b`; what b gets in return is summed here.
struct SoftPair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  Vec3d impulse_n_s = Vec3d::Zero();  // to b
  Vec3d shift_kg_m = Vec3d::Zero();   // to b: mass times displacement
  bool hit = false;
};

template <class Real>
void fit_boxes(const SoftState<Real>& body, BodyBounds& bounds);
/// Of the vertices that are not pinned; 0 where all are.
template <class Real>
[[nodiscard]] Vec3d mean_velocity(const SoftState<Real>& body);
template <class Real>
void fit_means(const SoftState<Real>& body, BodyBounds& bounds);

/// Fills `pairs` with both directions of each pair of bodies whose swept boxes, grown by their thickness, overlap; in
/// order of (a, b). Bodies that are not to meet soft bodies are left out, and pairs that both sleep. Sort and sweep
/// along x.
template <class Real>
void find_soft_pairs(std::span<const SoftState<Real>> soft, std::span<const BodyBounds> bounds,
                     std::vector<std::uint32_t>& order, std::vector<SoftPair>& pairs);

}  // namespace pneuma::physics
