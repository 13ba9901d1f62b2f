#include "physics/contact/bound_kernels.h"

#include <cassert>

#include "physics/lanes/isa.h"

namespace pneuma::physics {

// In the files compiled for them.
extern const BoundKernels bound_kernels_baseline;
#if defined(__x86_64__)
extern const BoundKernels bound_kernels_v3;
extern const BoundKernels bound_kernels_v4;
#endif

const BoundKernels& bound_kernels(Isa isa) {
  assert(has_isa(isa));
#if defined(__x86_64__)
  if (isa == Isa::v4) return bound_kernels_v4;
  if (isa == Isa::v3) return bound_kernels_v3;
#endif
  return bound_kernels_baseline;
}

}  // namespace pneuma::physics
