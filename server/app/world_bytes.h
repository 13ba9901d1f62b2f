// What a world takes in memory, estimated from its scene before it is set up: at most what it takes in ordinary motion,
// factors of matrices while they are made included.
#pragma once

#include <cstddef>
#include <map>
#include <memory>

#include "base/status.h"
#include "physics/scene/scene.h"
#include "pneuma/v1/scene.pb.h"

namespace pneuma::app {

struct WorldBytes {
  std::size_t as_explicit = 0;  // and by XPBD
  std::size_t as_implicit = 0;
  std::size_t vertices = 0;  // of all bodies

  /// Where the choice is open, the larger.
  [[nodiscard]] std::size_t by(physics::Integrator integrator) const;
};

/// Estimates for one world. What it finds out of meshes it keeps, since edits leave most of them.
class WorldEstimates {
 public:
  /// Refuses a mesh whose factored matrix would be too large (factor_entries_max), where the integrator may need it.
  [[nodiscard]] base::Result<WorldBytes> of(const v1::Scene& source, const physics::Scene& scene);

 private:
  using MeshPtr = std::shared_ptr<const physics::Mesh>;
  [[nodiscard]] std::size_t factor_entries_of(const MeshPtr& mesh);

  std::map<MeshPtr, std::size_t> factor_entries_;
};

/// What a stream's encoder takes for each vertex that it shows.
[[nodiscard]] double stream_bytes_per_vertex(bool velocities, bool time_layers, std::uint32_t level_of_detail);

}  // namespace pneuma::app
