// Elementary functions whose every bit is the same on each machine. The C library has variants of its own for each
// processor, and others in each release; a world that moves to another machine must go on as it would have here.
#pragma once

namespace pneuma::physics {

/// base^exponent of a positive base, to a few units in the last place times the size of the result's logarithm.
[[nodiscard]] double portable_pow(double base, double exponent);

/// The angle of (x, y) from the x axis, -pi to pi rad, within a few units in the last place; 0 of (0, 0).
[[nodiscard]] double portable_atan2(double y, double x);

struct SineCosine {
  double sine;
  double cosine;
};
/// Within 1e-15 for angles up to 1e5 rad; past that they lose a digit with each digit of the angle.
[[nodiscard]] SineCosine portable_sincos(double angle_rad);

}  // namespace pneuma::physics
