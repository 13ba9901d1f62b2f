// Where a pass of a coupled step left everything, for passes after it that may do worse.
#pragma once

#include <vector>

#include "physics/contact/coupled_passes.h"
#include "physics/contact/stopped_features.h"

namespace pneuma::physics {

class PassOutcome {
 public:
  [[nodiscard]] static PassOutcome of(const CoupledPasses& passes, const StoppedFeatures& stopped, double gained_j);
  /// Of the same step.
  void put_back(CoupledPasses& passes, StoppedFeatures& stopped) &&;

  /// More energy than there was as the step began.
  [[nodiscard]] double gained_j() const { return gained_j_; }

 private:
  struct Body {
    std::vector<Vec3d> places_m;
    std::vector<Vec3d> ends_m;  // without cuts
    std::vector<Vec3d> u;
    double stress_n_m = 0.0;
  };
  double gained_j_ = 0.0;
  std::vector<Body> bodies_;
  std::vector<SolidPlace> solids_;
  std::vector<Vec3d> rigid_velocities_m_s_, rigid_turnings_rad_s_;
  std::vector<ContactRow> rows_;
  StoppedFeatures stopped_;
};

}  // namespace pneuma::physics
