// The factor kernels for x86-64-v3: AVX2.
#define PNEUMA_LANES lanes_v3

#include "physics/implicit/factor_kernel_source.h"

namespace pneuma::physics {

extern const FactorKernels factor_kernels_v3;

constexpr FactorKernels factor_kernels_v3 = list_factor_kernels<Pack<double, 4>, Pack<double, 4>>();

}  // namespace pneuma::physics
