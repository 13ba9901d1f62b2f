#include "physics/contact/dense_kernels.h"

#include <cassert>

#include "physics/lanes/isa.h"

namespace pneuma::physics {

// In the files compiled for them.
extern const DenseKernels dense_kernels_baseline;
#if defined(__x86_64__)
extern const DenseKernels dense_kernels_v3;
extern const DenseKernels dense_kernels_v4;
#endif

const DenseKernels& dense_kernels(Isa isa) {
  assert(has_isa(isa));
#if defined(__x86_64__)
  if (isa == Isa::v4) return dense_kernels_v4;
  if (isa == Isa::v3) return dense_kernels_v3;
#endif
  return dense_kernels_baseline;
}

}  // namespace pneuma::physics
