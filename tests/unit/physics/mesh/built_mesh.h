// Meshes that tests build and look at as a whole.
#pragma once

#include <memory>

#include <gtest/gtest.h>

#include "base/status.h"
#include "physics/mesh/mesh.h"

namespace pneuma::physics {

using MeshPtr = std::shared_ptr<const Mesh>;

/// A failure of the test where it was refused.
inline MeshPtr built(base::Result<MeshPtr> result) {
  EXPECT_TRUE(result.ok()) << result.status().message();
  return result.ok() ? *result : nullptr;
}

inline long euler_characteristic(const Mesh& mesh) {
  return static_cast<long>(mesh.positions_m.size()) - static_cast<long>(mesh.edges.size()) +
         static_cast<long>(mesh.faces.size());
}

}  // namespace pneuma::physics
