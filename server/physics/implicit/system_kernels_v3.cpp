// The system kernels for x86-64-v3: AVX2.
#define PNEUMA_LANES lanes_v3

#include "physics/implicit/system_kernel_source.h"

namespace pneuma::physics {

extern const SystemKernels system_kernels_v3;

constexpr SystemKernels system_kernels_v3 = list_system_kernels<Pack<double, 4>>();

}  // namespace pneuma::physics
