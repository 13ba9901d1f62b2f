// Bullet's soft body in the place of ours.
#pragma once

#include "bench/peers.h"
#include "physics/scene.h"

namespace pneuma::extremes {

/// The body's skin, mass, gas, starting shape and velocity, in no gravity. Bullet's links have no stiffness in N/m:
/// that of the body counts for nothing.
[[nodiscard]] bench::BulletBall bullet_ball(const physics::SoftBody& body, double dt_s,
                                            const bench::BulletSettings& settings);

}  // namespace pneuma::extremes
