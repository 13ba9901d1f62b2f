// The factor kernels for any x86-64, and any other processor.
#define PNEUMA_LANES lanes_baseline

#include "physics/implicit/factor_kernel_source.h"

namespace pneuma::physics {

extern const FactorKernels factor_kernels_baseline;

constexpr FactorKernels factor_kernels_baseline = list_factor_kernels<Pack<double, 2>, Pack<double, 2>>();

}  // namespace pneuma::physics
