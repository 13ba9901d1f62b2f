#include "physics/contact/sweep_kernels.h"

#include <cassert>

#include "physics/lanes/isa.h"

namespace pneuma::physics {

// In the files compiled for them.
extern const SweepKernels sweep_kernels_baseline;
#if defined(__x86_64__)
extern const SweepKernels sweep_kernels_v3;  // a vector has four numbers, so v4 has nothing to add
#endif

const SweepKernels& sweep_kernels(Isa isa) {
  assert(has_isa(isa));
#if defined(__x86_64__)
  if (isa != Isa::baseline) return sweep_kernels_v3;
#endif
  return sweep_kernels_baseline;
}

}  // namespace pneuma::physics
