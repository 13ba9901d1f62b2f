// How the ends of an edge pull at each other as they move, in plain numbers that kernels read.
#pragma once

#include <cstddef>

namespace pneuma::physics {

/// Of an edge of the mesh; du is what its second end moves more than its first.
struct EdgeTangent {
  double direction[3] = {};
  double along = 0.0;   // N s^2/m, of springs and damping
  double turn[3] = {};  // of -P grad^2 V
  double across = 0.0;  // of stretched springs; a compressed one's is negative, and left out
};
// Kernels load four numbers from where each vector begins.
static_assert(sizeof(EdgeTangent) == 8 * sizeof(double));
static_assert(offsetof(EdgeTangent, turn) == 4 * sizeof(double));

}  // namespace pneuma::physics
