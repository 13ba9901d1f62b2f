// The factor kernels for x86-64-v4: AVX-512.
#define PNEUMA_LANES lanes_v4

#include "physics/implicit/factor_kernel_source.h"

namespace pneuma::physics {

extern const FactorKernels factor_kernels_v4;

constexpr FactorKernels factor_kernels_v4 = list_factor_kernels<Pack<double, 4>, Pack<double, 8>>();

}  // namespace pneuma::physics
