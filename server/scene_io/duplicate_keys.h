// JSON that says the same thing twice, or too much.
#pragma once

#include <string_view>

#include "base/status.h"

namespace pneuma::scene_io {

/// Refuses an object that has a key twice, by the key's path (`soft_bodies[1].mass_kg`). A parsed value cannot tell: it
/// holds the last of them. Refuses more than base::json_objects_max objects, each of which is a message in memory,
/// however little the text says of it; more than base::json_values_max values, which the parsed text would hold; and
/// more than base::json_keys_max keys in an object. Says nothing of text that is no JSON, past what it holds until
/// then.
[[nodiscard]] base::Status check_keys(std::string_view json);

}  // namespace pneuma::scene_io
