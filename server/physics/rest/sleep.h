// Bodies at rest sleep, in groups that touch, and wake in groups. No stage of a step runs for a sleeper; the awake meet
// it as they would a body at rest.
#pragma once

#include <span>
#include <vector>

#include "physics/state/state.h"
#include "physics/state/substep_context.h"

namespace pneuma::physics {

/// A group sleeps when each of its bodies has kept its place for this long...
inline constexpr double rest_time_s = 0.5;
/// ...no vertex further from it than this share of the body's length...
inline constexpr double rest_place_share = 1e-3;
/// ...and has no more kinetic energy than at this speed, in its lengths a second: falling asleep takes away no more.
/// The place decides. Vertices pressed on a floor with restitution go on trembling in place, at up to 0.07.
inline constexpr double rest_speed_1_s = 0.1;
/// Of a group with more awake bodies than this, such a share must keep their places. The others need only have been
/// near a place, by a few of their vertices, within this share of their length: in a heap there is always one that
/// rocks or creeps. Not bodies that joints hold: a load on a chain would stop short of where it comes to rest.
inline constexpr std::size_t small_group_bodies_max = 10;
inline constexpr double resting_share_min = 0.25;
inline constexpr double near_place_share = 1e-2;

/// At the end of a tick: notes which bodies keep their places, lets groups at rest fall asleep, and wakes what a moving
/// collider may reach in the next tick. A soft body that one of its forces keeps awake (force_term.h) does not rest.
template <class Real>
void settle(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, std::span<const ColliderState> colliders,
            const Surroundings& surroundings, double period_s);

template <class Real>
void wake_all(std::span<SoftState<Real>> soft, std::span<RigidState> rigid);

/// Wakes those bodies, and their groups, that would be other bodies in scene `wanted` or be acted on by other things,
/// so that a new scene can take over.
template <class Real>
void wake_changed(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, const Scene& live, const Scene& wanted);

}  // namespace pneuma::physics
