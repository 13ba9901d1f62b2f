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
  struct FaceBox {
    std::uint32_t face = 0;
    Box box;  // about its way, grown by the body's margin
  };

  /// Sets the pair's candidates: the features of faces whose ways, grown by the bodies' margins, overlap. Of a body
  /// with itself, those that share no vertex.
  void find(SurfacePair& pair, std::span<SurfaceBody> bodies);

  /// Likewise those that are within `reach_m` where the substep finds them, and some beyond.
  void find_near(SurfacePair& pair, std::span<SurfaceBody> bodies, double reach_m);

  /// Likewise of two bodies whose near faces are known: the features of those whose boxes overlap.
  void find_among(SurfacePair& pair, std::span<const SurfaceBody> bodies, std::vector<FaceBox>& near_first,
                  std::vector<FaceBox>& near_second);

  /// Whether an edge of one of two bodies runs through a face of the other where the substep finds them.
  [[nodiscard]] bool are_crossed(const SurfacePair& pair, std::span<const SurfaceBody> bodies);
  /// Where the first of two that are crossed has the shortest way out, about: along the normals of the faces that edges
  /// run through. A unit vector.
  [[nodiscard]] Vec3d way_apart(const SurfacePair& pair, std::span<const SurfaceBody> bodies);

 private:
  // Of one body: where its vertices are in the substep, or where it begins (`from` twice), and a margin.
  struct Ways {
    const SurfaceBody* body = nullptr;
    std::span<const Vec3d> from, to;
    Box all;
    double margin_m = 0.0;

    [[nodiscard]] Box box(std::uint32_t start, std::uint32_t end) const;
  };
  // Of the features that near faces own; those of others are out of date.
  struct FeatureBoxes {
    std::vector<Box> vertices, edges;

    void fit(const Ways& ways, std::uint32_t face);
    void fit(const Ways& ways, std::span<const FaceBox> faces) {
      for (const FaceBox& face : faces) fit(ways, face.face);
    }
  };
  static Ways ways_of(const SurfaceBody& body) { return {&body, body.from, body.to, body.way, body.margin_m}; }
  static Ways places_of(const SurfaceBody& body, double margin_m);
  void find(SurfacePair& pair, std::span<SurfaceBody> bodies, const Ways& a, const Ways& b);
  void take_near_faces(const Ways& a, const Ways& b);
  static void sort_by_low(std::vector<FaceBox>& faces);
  void meet(SurfacePair& pair, std::span<const SurfaceBody> bodies, const FaceBox& face_a, const FaceBox& face_b) const;
  void meet_near_faces(SurfacePair& pair, std::span<const SurfaceBody> bodies, const Ways& ways_a, const Ways& ways_b);
  template <class Visit>
  void for_near_faces(const Visit& visit) const;
  static void take_near_faces(const Ways& ways, const Vec3d& towards, double least_m, const Box& region,
                              std::vector<double>& heights_m, std::vector<FaceBox>& near);

  std::vector<double> heights_m_;
  std::vector<FaceBox> near_a_, near_b_;
  FeatureBoxes boxes_a_, boxes_b_;
};

}  // namespace pneuma::physics
