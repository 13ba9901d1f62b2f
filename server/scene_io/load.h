// Where scenes come from: built into the program, or files.
#pragma once

#include <string>
#include <vector>

#include "base/status.h"
#include "pneuma/v1/scene.pb.h"

namespace pneuma::scene_io {

/// Sorted.
[[nodiscard]] std::vector<std::string> builtin_scene_names();

/// Fails with not_found, listing the built-in ones.
[[nodiscard]] base::Result<v1::Scene> builtin_scene(const std::string& name);

/// A built-in scene by its name, or else the scene file of that path. Errors of a file begin with its path. A scene
/// without a name takes the file's.
[[nodiscard]] base::Result<v1::Scene> load_scene(const std::string& name_or_file);

/// An error of a scene, as load_scene gives its own: the name or path before the field's path, set off by a colon,
/// since both have dots of their own.
[[nodiscard]] base::Status in_scene(const base::Status& status, const std::string& name_or_file);

}  // namespace pneuma::scene_io
