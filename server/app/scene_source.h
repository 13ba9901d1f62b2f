// The scene that a request brings or names.
#pragma once

#include <string>

#include "base/status.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// A built-in scene, one in the request, or one as JSON; never a file of the server's. Errors name the field.
[[nodiscard]] base::Result<v1::Scene> scene_of(const v1::CreateWorld& request);

/// Where the scene stands in the request: `create_world.scene_json`.
[[nodiscard]] std::string source_field(const v1::CreateWorld& request);

}  // namespace pneuma::app
