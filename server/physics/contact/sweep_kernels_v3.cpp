// The sweep kernels for x86-64-v3: AVX2.
#define PNEUMA_LANES lanes_v3

#include "physics/contact/sweep_kernel_source.h"

namespace pneuma::physics {

extern const SweepKernels sweep_kernels_v3;

constexpr SweepKernels sweep_kernels_v3 = list_sweep_kernels<Pack<double, 4>>();

}  // namespace pneuma::physics
