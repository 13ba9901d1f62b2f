// Whether a substep of an implicit method left more energy than there was, and where it began: to step it again.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "physics/contact/joint.h"
#include "physics/contact/row.h"
#include "physics/contact/span_start.h"
#include "physics/state/substep_context.h"

namespace pneuma::physics {

template <class Real>
class GainWatch {
 public:
  /// Before the substep. `warm`: what its rows start from. Nothing is watched where something may do work on a body:
  /// wind, a grab, a gas that flows, a collider that moves. Nor is a joint that gives way, or whose ends are put apart.
  void begin(const SubstepContext& context, const Moving<Real>& moving, std::span<const JointState> joints,
             std::span<const WarmImpulse> warm);
  /// After everything has moved. Whether bodies had more energy than they began with, and have been put back.
  [[nodiscard]] bool take_back(const SubstepContext& context, const Moving<Real>& moving,
                               std::vector<WarmImpulse>& warm);
  [[nodiscard]] std::size_t bytes() const { return start_.bytes() + warm_.capacity() * sizeof(WarmImpulse); }

 private:
  SpanStart<Real> start_;
  std::vector<WarmImpulse> warm_;
  double kinetic_j_ = 0.0;
  double energy_j_ = 0.0;
};

}  // namespace pneuma::physics
