// The bound kernels for x86-64-v4: AVX-512.
#define PNEUMA_LANES lanes_v4

#include "physics/contact/bound_kernel_source.h"

namespace pneuma::physics {

extern const BoundKernels bound_kernels_v4;

constexpr BoundKernels bound_kernels_v4 = list_bound_kernels<Pack<float, 16>>();

}  // namespace pneuma::physics
