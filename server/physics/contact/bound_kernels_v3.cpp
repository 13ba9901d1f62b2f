// The bound kernels for x86-64-v3: AVX2.
#define PNEUMA_LANES lanes_v3

#include "physics/contact/bound_kernel_source.h"

namespace pneuma::physics {

extern const BoundKernels bound_kernels_v3;

constexpr BoundKernels bound_kernels_v3 = list_bound_kernels<Pack<float, 8>>();

}  // namespace pneuma::physics
