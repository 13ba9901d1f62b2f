// What contact answered in a substep, for those who show it.
#pragma once

#include <cstdint>
#include <vector>

#include "physics/scene/scene.h"

namespace pneuma::physics {

/// A vertex of a soft body that was held off something.
struct VertexContact {
  enum class Other { soft, rigid, collider };

  std::uint32_t vertex = 0;
  Other other = Other::soft;
  std::uint32_t index = 0;       // of the other, among those of its kind
  Vec3d normal = Vec3d::Zero();  // unit, out of the other
};

/// Of one body; a vertex that was answered several times has several.
using ContactNotes = std::vector<VertexContact>;

}  // namespace pneuma::physics
