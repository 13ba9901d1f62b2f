// The lane kernels for any x86-64, and any other processor.
#define PNEUMA_LANES lanes_baseline

#include "physics/lanes/lane_kernel_source.h"

namespace pneuma::physics {

extern const LaneKernels<float> lane_kernels_baseline_single;
extern const LaneKernels<double> lane_kernels_baseline_double;

constexpr LaneKernels<float> lane_kernels_baseline_single = list_kernels<Pack<float, 4>>();
constexpr LaneKernels<double> lane_kernels_baseline_double = list_kernels<Pack<double, 2>>();

}  // namespace pneuma::physics
