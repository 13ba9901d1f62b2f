// Requests' numbers, checked, as the engine takes them. Errors name the field.
#pragma once

#include <string>

#include "base/status.h"
#include "physics/world.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// Each component finite and at most `limit` in size.
[[nodiscard]] base::Result<physics::Vec3d> read_vector(const v1::Vec3& vector, double limit, const std::string& field);

/// Finite, at least 0 and at most `limit`.
[[nodiscard]] base::Status check_amount(double value, double limit, const std::string& field);

/// The point of a body that the request names.
[[nodiscard]] base::Result<physics::At> read_at(const v1::Impulse& impulse);
[[nodiscard]] base::Result<physics::At> read_at(const v1::Grab& grab);

/// Of slow motion.
[[nodiscard]] base::Status check_time_scale(const v1::Resume& resume);

/// A world's name is part of file names, log lines and addresses: letters, digits, '.', '_' and '-', not first a '.'.
[[nodiscard]] base::Status check_world_name(const std::string& name, const std::string& field);
/// The nearest good world name: other characters become '-'.
[[nodiscard]] std::string to_world_name(const std::string& scene_name);

}  // namespace pneuma::app
