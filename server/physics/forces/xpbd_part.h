// What a force is in a substep of XPBD (xpbd/xpbd.h): pushes of the predicted velocities, compliant constraints with
// their multipliers, and damping of the velocities after the move.
#pragma once

#include <concepts>
#include <cstddef>
#include <span>

#include "physics/state/state.h"
#include "physics/state/substep_context.h"

namespace pneuma::physics {

/// A body under way. Its x stays; dr is the move so far.
template <class Real>
struct XpbdPlace {
  SoftState<Real>& body;
  const Surroundings& surroundings;
  double h_s = 0.0;
  std::span<const Real> inverse_masses_1_kg = {};  // 0 of pinned vertices
  Profile* profile = nullptr;
};

/// Which way a pass goes over a force's constraints.
enum class XpbdWay { there, back };

/// Calls work(i) for each of `count` constraints.
template <class Work>
void go_over(std::size_t count, XpbdWay way, const Work& work) {
  if (way == XpbdWay::there) {
    for (std::size_t i = 0; i < count; ++i) work(i);
  } else {
    for (std::size_t i = count; i-- > 0;) work(i);
  }
}

/// A force's own room in XPBD, kept between substeps, with all that it does there.
template <class Part, class Real>
concept XpbdPart = requires(Part& part, const Part& still, const XpbdPlace<Real>& place, XpbdWay way,
                            std::span<Vec3<Real>> velocities_m_s) {
  { part.push(place, velocities_m_s) } -> std::same_as<void>;  // before the move
  { part.begin(place) } -> std::same_as<void>;                 // its multipliers, at 0
  { part.pass(place, way) } -> std::same_as<void>;             // over its constraints, there and back
  { part.pass_between(place) } -> std::same_as<void>;          // once, between there and back: over one of all vertices
  { part.damp(place) } -> std::same_as<void>;                  // the velocities, after the move
  { still.bytes() } -> std::same_as<std::size_t>;
};

// What a part does not do is said by these.
struct XpbdNoPush {
  template <class Place, class Velocities>
  static void push(const Place&, const Velocities&) {}
};
struct XpbdNoConstraints {
  template <class Place>
  static void begin(const Place&) {}
  template <class Place>
  static void pass(const Place&, XpbdWay) {}
};
struct XpbdNoneBetween {
  template <class Place>
  static void pass_between(const Place&) {}
};
struct XpbdNoDamping {
  template <class Place>
  static void damp(const Place&) {}
};
struct XpbdNoRoom {
  [[nodiscard]] static std::size_t bytes() { return 0; }
};

}  // namespace pneuma::physics
