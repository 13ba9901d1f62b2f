// The feature kernels for x86-64-v4: AVX-512.
#define PNEUMA_LANES lanes_v4

#include "physics/contact/feature_kernel_source.h"

namespace pneuma::physics {

extern const FeatureKernels feature_kernels_v4;

constexpr FeatureKernels feature_kernels_v4 = list_feature_kernels<Pack<double, 8>>();

}  // namespace pneuma::physics
