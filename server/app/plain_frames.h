// Frames for readers without a codec: numbers as they are.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "pneuma/v1/frame.pb.h"

namespace pneuma::app {

/// Where 16-bit integers count from, and by how much, so that positions (three numbers each) are within `max_error_m`.
/// Nothing where they lie too far apart for it.
[[nodiscard]] std::optional<v1::Int16Grid> int16_grid(std::span<const double> positions_m, double max_error_m);
/// The step likewise, counted from 0; 0 where velocities are too large for it.
[[nodiscard]] double int16_velocity_step_m_s(std::span<const double> velocities_m_s, double max_error_m_s);

/// Little-endian 16-bit integers, three a vector: (vector - origin) / step.
void append_int16(std::span<const double> numbers, const v1::Vec3& origin, double step, std::string& out);

}  // namespace pneuma::app
