// Scenes and edits as text: protobuf's JSON mapping, read strictly, with errors that name the field.
#pragma once

#include <string_view>

#include "base/status.h"
#include "pneuma/v1/scene.pb.h"

namespace pneuma::scene_io {

/// Field names may be snake_case or lowerCamelCase, as protobuf has it; null leaves a field unset. Refused with the
/// field's full path (`soft_bodies[1].springs.stifness_n_m: unknown field; did you mean stiffness_n_m?`): an unknown
/// field or enum name, a wrong type, a number out of its type's range, NaN and infinity, a field given twice in both
/// spellings, two of a oneof, the same key twice, more values than any scene has. Text that is no JSON is refused with
/// its line and column.
[[nodiscard]] base::Result<v1::Scene> parse_scene_json(std::string_view text);
[[nodiscard]] base::Result<v1::SceneEdit> parse_edit_json(std::string_view text);

}  // namespace pneuma::scene_io
