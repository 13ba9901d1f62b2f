// Setting one field of a scene from a line of text, as `pneuma-sim --set` does.
#pragma once

#include <string>

#include "base/status.h"
#include "pneuma/v1/scene.pb.h"

namespace pneuma::scene_io {

/// `soft_bodies[0].gas.moles=0.5`, or by name: `soft_bodies.ball.gas.moles=0.5`. The value is JSON, read as in a scene
/// file; a bare word is a string or an enum's name, and `null` clears the field. Messages on the way are made where
/// they are unset; lists are not made longer.
[[nodiscard]] base::Status set_path(v1::Scene& scene, const std::string& assignment);

}  // namespace pneuma::scene_io
