// What the separating axis tests of boxes and of convex meshes have alike.
#pragma once

namespace pneuma::physics {

// Of the lesser half width. Edges must win clearly, or bodies at rest face on face would flicker between a face's
// points and an edge's one.
inline constexpr double edge_handicap = 1e-3;
// Crosses of edges this near to parallel say nothing that a face does not.
inline constexpr double parallel_sine = 1e-4;

}  // namespace pneuma::physics
