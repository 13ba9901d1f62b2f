#include "physics/implicit/system_kernels.h"

#include <cassert>

#include "physics/lanes/isa.h"

namespace pneuma::physics {

// In the files compiled for them.
extern const SystemKernels system_kernels_baseline;
#if defined(__x86_64__)
extern const SystemKernels system_kernels_v3;  // a row has four numbers, so v4 has nothing to add
#endif

const SystemKernels& system_kernels(Isa isa) {
  assert(has_isa(isa));
#if defined(__x86_64__)
  if (isa != Isa::baseline) return system_kernels_v3;
#endif
  return system_kernels_baseline;
}

}  // namespace pneuma::physics
