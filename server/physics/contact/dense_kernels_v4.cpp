// The dense kernels for x86-64-v4: AVX-512.
#define PNEUMA_LANES lanes_v4

#include "physics/contact/dense_kernel_source.h"

namespace pneuma::physics {

extern const DenseKernels dense_kernels_v4;

constexpr DenseKernels dense_kernels_v4 = list_dense_kernels<Pack<double, 8>, 2>();

}  // namespace pneuma::physics
