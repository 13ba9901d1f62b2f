// What every part of a substep is told, besides the bodies.
#pragma once

#include <cstdint>

#include "physics/machine/profile.h"
#include "physics/machine/workers.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

/// What acts on every body of a world alike.
struct Surroundings {
  Vec3d gravity = Vec3d::Zero();  // m/s^2
  Atmosphere atmosphere;
};

/// How a substep goes, what acts in it, who does the work, and who counts the time.
struct SubstepContext {
  Integrator integrator = Integrator::midpoint;  // never automatic
  Surroundings surroundings = {};
  double dt_s = 0.0;
  bool is_first_of_tick = true;     // contact starts from nothing
  bool repairs = true;              // rows of implicit steps part what overlaps, and close joints
  std::uint32_t substeps_left = 1;  // of the tick, with this one
  Workers* workers = nullptr;       // null: the calling thread works alone
  Profile* profile = nullptr;       // null: nobody asks where the time goes

  [[nodiscard]] bool is_last_of_tick() const { return substeps_left == 1; }
  /// The same for the work on one body. It counts its time by itself, so that threads share no row.
  [[nodiscard]] SubstepContext of_body(Workers* body_workers, Profile* body_profile) const {
    SubstepContext context = *this;
    context.workers = body_workers;
    context.profile = body_profile;
    return context;
  }
};

}  // namespace pneuma::physics
