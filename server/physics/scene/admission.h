// The gate of the engine: everything numeric that a scene can get wrong is refused here, so that the step need not ask.
#pragma once

#include "base/status.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

/// OK, or the first thing wrong in the scene's own order; `where` is the field's path in the names of scene.proto,
/// such as `soft_bodies[2].springs.stiffness_n_m` or `colliders[0].shape.sphere.radius_m`.
/// Checks counts, names, numbers (finite, in range), unit quaternions and normals, that meshes with gas hold it, pins,
/// and that single precision tells a mesh's vertices apart where the body starts.
/// Meshes themselves were checked when they were made (mesh.h).
[[nodiscard]] base::Status check_scene(const Scene& scene);

}  // namespace pneuma::physics
