// The feature kernels for any x86-64, and any other processor.
#define PNEUMA_LANES lanes_baseline

#include "physics/contact/feature_kernel_source.h"

namespace pneuma::physics {

extern const FeatureKernels feature_kernels_baseline;

constexpr FeatureKernels feature_kernels_baseline = list_feature_kernels<Pack<double, 2>>();

}  // namespace pneuma::physics
