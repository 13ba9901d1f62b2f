// The feature kernels for x86-64-v3: AVX2.
#define PNEUMA_LANES lanes_v3

#include "physics/contact/feature_kernel_source.h"

namespace pneuma::physics {

extern const FeatureKernels feature_kernels_v3;

constexpr FeatureKernels feature_kernels_v3 = list_feature_kernels<Pack<double, 4>>();

}  // namespace pneuma::physics
