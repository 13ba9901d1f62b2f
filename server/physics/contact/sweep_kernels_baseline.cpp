// The sweep kernels for any processor.
#define PNEUMA_LANES lanes_baseline

#include "physics/contact/sweep_kernel_source.h"

namespace pneuma::physics {

extern const SweepKernels sweep_kernels_baseline;

constexpr SweepKernels sweep_kernels_baseline = list_sweep_kernels<Pack<double, 4>>();

}  // namespace pneuma::physics
