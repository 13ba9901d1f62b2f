#include "physics/lanes/body_extents.h"

#include "physics/lanes/isa.h"
#include "physics/lanes/lane_kernels.h"

namespace pneuma::physics {

template <class Real>
Extents<Real> extents_of(const SoftState<Real>& body) {
  Extents<Real> extents;
  lane_kernels<Real>(isa_in_use())
      .extents({body.x.front().data(), body.dr.front().data(), body.v.front().data(), 3 * body.x.size(), &extents});
  return extents;
}

template Extents<float> extents_of(const SoftState<float>&);
template Extents<double> extents_of(const SoftState<double>&);

}  // namespace pneuma::physics
