// The lane kernels for x86-64-v3: AVX2 and fused multiply-add.
#define PNEUMA_LANES lanes_v3

#include "physics/lanes/lane_kernel_source.h"

namespace pneuma::physics {

extern const LaneKernels<float> lane_kernels_v3_single;
extern const LaneKernels<double> lane_kernels_v3_double;

constexpr LaneKernels<float> lane_kernels_v3_single = list_kernels<Pack<float, 8>>();
constexpr LaneKernels<double> lane_kernels_v3_double = list_kernels<Pack<double, 4>>();

}  // namespace pneuma::physics
