// The dense kernels for any x86-64, and any other processor.
#define PNEUMA_LANES lanes_baseline

#include "physics/contact/dense_kernel_source.h"

namespace pneuma::physics {

extern const DenseKernels dense_kernels_baseline;

constexpr DenseKernels dense_kernels_baseline = list_dense_kernels<Pack<double, 2>, 1>();

}  // namespace pneuma::physics
