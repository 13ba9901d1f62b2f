// How a soft body's mass is shared by its vertices.
#pragma once

#include <vector>

#include "physics/scene/scene.h"

namespace pneuma::physics {

/// Each vertex's mass over the mean of all; empty where all are alike.
[[nodiscard]] std::vector<double> mass_shares(const SoftBody& body);

}  // namespace pneuma::physics
