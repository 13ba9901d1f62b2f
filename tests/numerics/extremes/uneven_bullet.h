// Bodies that are not alike all over, by Bullet.
#pragma once

#include <string>

#include "physics/scene/scene.h"

namespace pneuma::extremes {

/// Of the scene's first body in its gravity for ten seconds: the longest of its stiffest links, over its length.
[[nodiscard]] std::string overstretch_in_bullet(const physics::Scene& scene);

/// Of the scene's first body, alone for ten seconds: the momentum lost and the spin about its centre of mass, in single
/// precision as Debian has it, without Bullet's own damping.
[[nodiscard]] std::string momentum_lost_in_bullet(const physics::Scene& scene);

}  // namespace pneuma::extremes
