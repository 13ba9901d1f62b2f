// Features that the filter stopped (filter.h): they hit each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/groups.h"
#include "physics/contact/surface_body.h"

namespace pneuma::physics {

/// Left with their velocities, vertices that the filter holds between others for long would be sped up without an end.
/// So those that stopped each other lose a share of what they move by among themselves. Their momentum stays.
class StoppedFeatures {
 public:
  struct Vertex {
    std::uint32_t body = 0;
    std::uint32_t vertex = 0;
    // To be set by the caller, before stop(). Without a mass it takes no part, unless it is held.
    double mass_kg = 0.0;
    bool is_held = false;            // it does not give way
    double share = 1.0;              // of its move, that it made; of free ones of what they move by among themselves
    Vec3d missed_m = Vec3d::Zero();  // from where it ends to where it would
    Vec3d velocity_m_s = Vec3d::Zero();
  };

  StoppedFeatures() = default;
  explicit StoppedFeatures(std::span<const FeatureCorners> stopped);
  /// Each once, sorted by body.
  [[nodiscard]] std::span<Vertex> vertices() { return vertices_; }
  [[nodiscard]] std::span<const Vertex> vertices() const { return vertices_; }
  /// Sets the velocities of those that have a mass.
  void stop();
  [[nodiscard]] std::size_t bytes() const { return vertices_.capacity() * sizeof(Vertex) + joined_.bytes(); }

 private:
  std::vector<Vertex> vertices_;
  JoinedBodies joined_;  // of their indices
};

}  // namespace pneuma::physics
