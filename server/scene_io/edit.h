// Edits of a scene.
#pragma once

#include <string>
#include <vector>

#include "base/status.h"
#include "pneuma/v1/scene.pb.h"

namespace pneuma::scene_io {

/// The scene with all of the edit's changes, in their order; or the first change that cannot be made, by its path
/// (`changes[2].change_soft_body.name: no soft body is named "x"`). Names, references and what an edit itself may not
/// do are checked here, and that all numbers are finite; their ranges by to_physics on the result.
[[nodiscard]] base::Result<v1::Scene> apply_edit(const v1::Scene& scene, const v1::SceneEdit& edit);

/// The names of the bodies that begin anew with the edit: those that it adds, a removed one's name given again too, and
/// rigid bodies whose place or motion it sets.
[[nodiscard]] std::vector<std::string> renewed_bodies(const v1::SceneEdit& edit);

}  // namespace pneuma::scene_io
