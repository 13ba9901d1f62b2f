// The dense kernels for x86-64-v3: AVX2.
#define PNEUMA_LANES lanes_v3

#include "physics/contact/dense_kernel_source.h"

namespace pneuma::physics {

extern const DenseKernels dense_kernels_v3;

constexpr DenseKernels dense_kernels_v3 = list_dense_kernels<Pack<double, 4>, 1>();

}  // namespace pneuma::physics
