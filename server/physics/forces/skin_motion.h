// How stiff and how damped a body is at rest, as the choice of its steps asks (choice/stability.h).
#pragma once

#include <vector>

#include "physics/forces/tangents.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

/// Of each spring, along it and across.
struct SpringTerms {
  double along = 0.0;
  double across = 0.0;
  const Springs* scaled_by = nullptr;  // null: all springs are alike

  [[nodiscard]] double scale(const Edge& edge) const {
    return scaled_by == nullptr ? 1.0 : scaled_by->stiffness_scale(edge);
  }
};

/// Of a skin in its mesh's shape, whatever its mass and gas.
struct SkinMotion {
  SpringTerms stiffness;                         // N/m
  SpringTerms damping;                           // N s/m
  std::vector<FourPointTangent> undamped_bends;  // stiffness in N/m
};

}  // namespace pneuma::physics
