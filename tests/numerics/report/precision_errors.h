// How far one run of a scene is from another.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "physics/world.h"

namespace pneuma::report::precision {

/// A world at the end of a tick.
struct Sample {
  std::vector<std::vector<physics::Vec3d>> positions_m;  // of each soft body's vertices
  std::vector<physics::BodyMeasures> soft;
  std::vector<physics::Vec3d> rigid_m;  // of each rigid body's centre
  // Of soft and rigid bodies together; of these without their spin.
  double kinetic_j = 0.0;
  double energy_j = 0.0;  // kinetic, elastic, of gas and of height
  physics::Vec3d momentum = physics::Vec3d::Zero();
  physics::Vec3d angular_momentum = physics::Vec3d::Zero();
};

struct Trajectory {
  std::vector<Sample> samples;  // at the start, and after each tick
  std::string failure;          // why it ended before its time; empty: it did not
};

/// Root mean squares over the ticks, each without a unit. Not a number: the case does not have it.
struct Errors {
  static constexpr double none = std::numeric_limits<double>::quiet_NaN();
  double position = none;          // of the vertices, in body sizes, before anything touches
  double centre = none;            // centres of mass, in body sizes
  double volume = none;            // of its own
  double energy = none;            // in the most that is kinetic, or won or lost since the start
  double momentum = none;          // in mass times the greatest speed
  double angular_momentum = none;  // in mass times the greatest speed times body size
  double period = none;            // of breathing
  double volume_at_rest = none;    // the mean of the last half second
  double radius_at_rest = none;    // of a ball of that volume
};

/// What errors of a case are measured in, and when.
struct Measuring {
  std::vector<double> sizes_m = {};  // of each soft body
  double mass_kg = 0.0;              // of all of them
  std::uint64_t free_ticks = 0;
  std::uint64_t rest_ticks = 0;  // the last ones; 0: it does not come to rest
  double period_s = 0.0;         // of breathing, about; 0: it does not breathe
  double tick_s = 0.0;
};

/// The largest side of the bounding box of a mesh.
[[nodiscard]] double size_m(const physics::Mesh& mesh);

/// Of a run that did not fail, against a reference of as many samples.
[[nodiscard]] Errors errors_of(const Trajectory& run, const Trajectory& reference, const Measuring& measuring);

/// The period of a signal sampled every dt_s, near `guess_s`: that of the constant and sinusoid nearest to it in least
/// squares, over periods from 0.7 to 1.4 times the guess.
[[nodiscard]] double fitted_period_s(std::span<const double> signal, double dt_s, double guess_s);

}  // namespace pneuma::report::precision
