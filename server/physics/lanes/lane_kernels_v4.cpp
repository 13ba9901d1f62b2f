// The lane kernels for x86-64-v4: AVX-512.
#define PNEUMA_LANES lanes_v4

#include "physics/lanes/lane_kernel_source.h"

namespace pneuma::physics {

extern const LaneKernels<float> lane_kernels_v4_single;
extern const LaneKernels<double> lane_kernels_v4_double;

constexpr LaneKernels<float> lane_kernels_v4_single = list_kernels<Pack<float, 16>>();
constexpr LaneKernels<double> lane_kernels_v4_double = list_kernels<Pack<double, 8>>();

}  // namespace pneuma::physics
