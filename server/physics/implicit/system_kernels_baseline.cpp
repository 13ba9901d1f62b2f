// The system kernels for any processor.
#define PNEUMA_LANES lanes_baseline

#include "physics/implicit/system_kernel_source.h"

namespace pneuma::physics {

extern const SystemKernels system_kernels_baseline;

constexpr SystemKernels system_kernels_baseline = list_system_kernels<Pack<double, 4>>();

}  // namespace pneuma::physics
