// The features of two surfaces, or of one, that may meet in a substep.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/closest.h"
#include "physics/contact/surface_body.h"

namespace pneuma::physics {

/// Finds candidates; room for one pair at a time.
class CandidateFinder {
 public:
  /// Sets the pair's candidates: the features of faces whose ways, grown by the bodies' margins, overlap. Of a body
  /// with itself, those that share no vertex.
  void find(SurfacePair& pair, std::span<SurfaceBody> bodies);

  /// Whether an edge of one of two bodies runs through a face of the other where the substep finds them.
  [[nodiscard]] bool are_crossed(const SurfacePair& pair, std::span<const SurfaceBody> bodies);

 private:
  struct FaceBox {
    std::uint32_t face = 0;
    Box box;
  };
  template <class Visit>
  void for_near_faces(const SurfaceBody& a, const SurfaceBody& b, const Visit& visit);
  static void take_near_faces(const SurfaceBody& body, const Vec3d& towards, double least_m, const Box& region,
                              std::vector<double>& heights_m, std::vector<FaceBox>& near);

  std::vector<double> heights_m_;
  std::vector<FaceBox> near_a_, near_b_;
};

}  // namespace pneuma::physics
