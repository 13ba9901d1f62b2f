// Requests' numbers, checked, as the engine takes them. Errors name the field.
#pragma once

#include <string>
#include <vector>

#include "base/status.h"
#include "physics/mesh/picking.h"
#include "physics/queries.h"
#include "physics/world.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// Each component finite and at most `limit` in size.
[[nodiscard]] base::Result<physics::Vec3d> read_vector(const v1::Vec3& vector, double limit, const std::string& field);

/// Finite, at least 0 and at most `limit`.
[[nodiscard]] base::Status check_amount(double value, double limit, const std::string& field);

/// A ray of a direction of length 1. Errors name `field`.origin or .direction.
[[nodiscard]] base::Result<physics::Ray> read_ray(const v1::Vec3& origin, const v1::Vec3& direction,
                                                  const std::string& field);

/// Soft bodies, rigid bodies and colliders by name; of no names, all.
[[nodiscard]] base::Result<std::vector<physics::BodyRef>> read_bodies(
    const physics::World& world, const google::protobuf::RepeatedPtrField<std::string>& names,
    const std::string& field);

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
