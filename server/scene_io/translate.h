// Between the scene of the protocol and the scene of the engine.
#pragma once

#include "base/status.h"
#include "physics/scene/scene.h"
#include "pneuma/v1/scene.pb.h"
#include "scene_io/mesh_library.h"

namespace pneuma::scene_io {

/// Fills in the defaults that scene.proto states and checks the result (physics/scene/admission.h): what comes back can
/// be stepped. Bodies share the meshes of the library, which must be the scene's own. Errors name the field's path;
/// counts are checked before anything is allocated. What this version does not build (soft-soft contact against
/// triangles, self-collision...) is refused with StatusCode::unsupported.
[[nodiscard]] base::Result<physics::Scene> to_physics(const v1::Scene& scene, const MeshLibrary& meshes);
/// The same, with the meshes built for it.
[[nodiscard]] base::Result<physics::Scene> to_physics(const v1::Scene& scene);

/// `current` with the amounts and temperatures of gas as they are in `live`, and without what burst and the joints that
/// broke; bodies and joints are matched by name.
[[nodiscard]] v1::Scene to_proto(const physics::Scene& live, const v1::Scene& current);

[[nodiscard]] v1::Shape to_proto(const physics::Shape& shape);

}  // namespace pneuma::scene_io
