// Bullet's soft body in the place of ours.
#pragma once

#include <vector>

#include "bench/peers.h"
#include "physics/scene/scene.h"

namespace pneuma::extremes {

/// The body's skin, mass, pins, gas, starting shape, place and motion. Bullet's links have no stiffness in N/m: of the
/// body's counts only how it differs from the stiffest vertices, whose links have that of the settings.
[[nodiscard]] bench::BulletBall bullet_ball(const physics::SoftBody& body, double dt_s,
                                            const bench::BulletSettings& settings, double gravity_m_s2 = 0.0);

/// Of each vertex; 0 of one that is pinned.
[[nodiscard]] std::vector<double> vertex_masses_kg(const physics::SoftBody& body);

/// The share of strain that a single pass a step takes off a link between vertices of that mass, where a spring of that
/// stiffness would, solved implicitly.
[[nodiscard]] double link_stiffness_of(double stiffness_n_m, double vertex_mass_kg, double dt_s);

}  // namespace pneuma::extremes
