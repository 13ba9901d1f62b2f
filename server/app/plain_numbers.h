// Numbers as they are, for readers without a codec: of plain frames, and of states.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "pneuma/v1/frame.pb.h"

namespace pneuma::app {

/// Little-endian floats, or doubles, one after the other.
void append_numbers(std::span<const double> numbers, bool double_precision, std::string& out);
/// What append_numbers() wrote; refuses bytes that are no whole number of them.
[[nodiscard]] base::Result<std::vector<double>> read_numbers(const std::string& bytes, bool double_precision,
                                                             const std::string& field);

/// Where 16-bit integers count from, and by how much, so that positions (three numbers each) are within `max_error_m`.
/// Nothing where they lie too far apart for it.
[[nodiscard]] std::optional<v1::Int16Grid> int16_grid(std::span<const double> positions_m, double max_error_m);
/// The step likewise, counted from 0; 0 where velocities are too large for it.
[[nodiscard]] double int16_velocity_step_m_s(std::span<const double> velocities_m_s, double max_error_m_s);

/// Little-endian 16-bit integers, three a vector: (vector - origin) / step.
void append_int16(std::span<const double> numbers, const v1::Vec3& origin, double step, std::string& out);

/// The vertices of one frame.
class PlainFrame {
 public:
  /// In 16 bits where they hold the positions within `max_error_m`, otherwise in floats.
  void take_positions(std::span<const double> positions_m, double max_error_m);
  /// After the positions of the same frame; in 16 bits where those are and these fit.
  void take_velocities(std::span<const double> velocities_m_s, double max_error_m_s);
  void write(v1::Frame& frame) const;

 private:
  std::string positions_;
  std::string velocities_;
  std::optional<v1::Int16Grid> int16_;
};

}  // namespace pneuma::app
