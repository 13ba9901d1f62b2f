// Groups of bodies that touch, or nearly do, or that joints tie together. They fall asleep (sleep.h) and wake together.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "physics/state/bounds.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// What a body needs to tell of itself, soft or rigid.
struct Extent {
  bool counts = false;
  bool rigid = false;
  bool meets_soft = true;
  std::uint32_t tie = 0;  // by joints, 0: to none
  Aabb<double> box;
  double reach_m = 0.0;
};

template <class Real>
[[nodiscard]] Extent extent_of(const SoftState<Real>& body);
[[nodiscard]] Extent extent_of(const RigidState& body);

/// Of all bodies, soft ones first; those for which `counts` is false are left out.
template <class Real, class Counts>
[[nodiscard]] std::vector<Extent> extents_of(std::span<const SoftState<Real>> soft, std::span<const RigidState> rigid,
                                             const Counts& counts) {
  std::vector<Extent> extents(soft.size() + rigid.size());
  for (std::size_t i = 0; i < soft.size(); ++i) {
    if (counts(soft[i])) extents[i] = extent_of(soft[i]);
  }
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    if (counts(rigid[i])) extents[soft.size() + i] = extent_of(rigid[i]);
  }
  return extents;
}

/// The bodies that `first` may touch, directly or through others; takes them out of those that count.
[[nodiscard]] std::vector<std::size_t> take_group(std::span<Extent> extents, std::size_t first);

template <class Real>
void wake(SoftState<Real>& body);
void wake(RigidState& body);

/// Wakes a body and whatever sleeps in a group with it; returns those it woke. Bodies are counted soft ones first, then
/// rigid ones.
template <class Real>
std::vector<std::size_t> wake_group(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, std::size_t body);

}  // namespace pneuma::physics
