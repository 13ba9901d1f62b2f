// The bound kernels for any x86-64, and any other processor.
#define PNEUMA_LANES lanes_baseline

#include "physics/contact/bound_kernel_source.h"

namespace pneuma::physics {

extern const BoundKernels bound_kernels_baseline;

constexpr BoundKernels bound_kernels_baseline = list_bound_kernels<Pack<float, 4>>();

}  // namespace pneuma::physics
