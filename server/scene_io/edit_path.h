// Where in an edit an error of the edited scene comes from.
#pragma once

#include "base/status.h"
#include "pneuma/v1/scene.pb.h"

namespace pneuma::scene_io {

/// An error of the edited scene, by the last change that could have brought it: `soft_bodies[2].mesh` becomes
/// `changes[0].add_soft_body.mesh`. Where no change holds the field, as where a new rate makes a body unstable, `where`
/// is empty and the scene's own path stands in the text.
[[nodiscard]] base::Status by_change(const base::Status& status, const v1::Scene& edited, const v1::SceneEdit& edit);

}  // namespace pneuma::scene_io
