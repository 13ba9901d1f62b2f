// Recordings that benchmarks read.
#pragma once

#include <cstdint>
#include <string>

#include "base/status.h"
#include "pneuma/v1/scene.pb.h"

namespace pneuma::bench {

/// What `pneuma record` makes of the scene's first ticks at 60 Hz, with a key frame a second.
[[nodiscard]] base::Status record_ticks(const v1::Scene& scene, std::uint64_t ticks, const std::string& path);

}  // namespace pneuma::bench
