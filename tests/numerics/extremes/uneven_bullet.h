// Bodies that are not alike all over, by Bullet.
#pragma once

#include <string>

#include "physics/scene.h"

namespace pneuma::extremes {

/// Of the scene's first body in its gravity for ten seconds: the longest of its stiffest links, over its length.
[[nodiscard]] std::string overstretch_in_bullet(const physics::Scene& scene);

}  // namespace pneuma::extremes
