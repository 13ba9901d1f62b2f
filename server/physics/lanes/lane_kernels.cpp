#include "physics/lanes/lane_kernels.h"

#include <cassert>

#include "physics/lanes/isa.h"

namespace pneuma::physics {

// In the files compiled for them.
extern const LaneKernels<float> lane_kernels_baseline_single;
extern const LaneKernels<double> lane_kernels_baseline_double;
#if defined(__x86_64__)
extern const LaneKernels<float> lane_kernels_v3_single;
extern const LaneKernels<double> lane_kernels_v3_double;
extern const LaneKernels<float> lane_kernels_v4_single;
extern const LaneKernels<double> lane_kernels_v4_double;
#endif

template <>
const LaneKernels<float>& lane_kernels<float>(Isa isa) {
  assert(has_isa(isa));
#if defined(__x86_64__)
  if (isa == Isa::v4) return lane_kernels_v4_single;
  if (isa == Isa::v3) return lane_kernels_v3_single;
#endif
  return lane_kernels_baseline_single;
}

template <>
const LaneKernels<double>& lane_kernels<double>(Isa isa) {
  assert(has_isa(isa));
#if defined(__x86_64__)
  if (isa == Isa::v4) return lane_kernels_v4_double;
  if (isa == Isa::v3) return lane_kernels_v3_double;
#endif
  return lane_kernels_baseline_double;
}

}  // namespace pneuma::physics
