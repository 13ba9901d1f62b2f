// The features of two surfaces, or of one, that may meet in a substep.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "physics/contact/closest.h"
#include "physics/contact/feature_kernels.h"
#include "physics/contact/surface_body.h"
#include "physics/lanes/isa.h"

namespace pneuma::physics {

/// Finds candidates; room for one pair at a time.
class CandidateFinder {
 public:
  struct FaceBox {
    std::uint32_t face = 0;
    Box box;  // about its way, grown by the body's margin
  };

  /// From here on it looks at so many pairs of features at most: faces that may be crossed, and those that become
  /// candidates. What it finds after that lacks some.
  void allow(std::size_t looks) { looks_left_ = looks; }
  [[nodiscard]] std::size_t looks_left() const { return looks_left_; }
  /// Whether it would have looked at more.
  [[nodiscard]] bool is_exhausted() const { return looks_left_ == 0; }

  /// Sets the pair's candidates: the features of faces whose ways, grown by the bodies' margins, overlap. Of a body
  /// with itself, those that share no vertex.
  void find(SurfacePair& pair, std::span<SurfaceBody> bodies);

  /// Adds to the candidates of two bodies those that they lack since vertices went astray (SurfaceBody), and some that
  /// they have.
  void add_astray(SurfacePair& pair, std::span<const SurfaceBody> bodies);

  /// Likewise of two bodies whose near faces are known: the features of those whose boxes overlap.
  void find_among(SurfacePair& pair, std::span<const SurfaceBody> bodies, std::vector<FaceBox>& near_first,
                  std::vector<FaceBox>& near_second);

  /// Whether an edge of one of two bodies runs through a face of the other where the substep finds them.
  [[nodiscard]] bool are_crossed(const SurfacePair& pair, std::span<const SurfaceBody> bodies);
  /// Where the first of two that are crossed has the shortest way out, about: along the normals of the faces that edges
  /// run through. A unit vector.
  [[nodiscard]] Vec3d way_apart(const SurfacePair& pair, std::span<const SurfaceBody> bodies);

  [[nodiscard]] std::size_t bytes() const;

 private:
  // Of one body: where its vertices are in the substep, or where it begins (`from` twice), and a margin.
  struct Ways {
    const SurfaceBody* body = nullptr;
    std::span<const Vec3d> from, to;
    Box all;
    double margin_m = 0.0;

    [[nodiscard]] Box box(std::uint32_t start, std::uint32_t end) const;
  };
  // Ways as they are in another frame.
  struct SeenWays {
    std::vector<Vec3d> from, to;

    [[nodiscard]] std::size_t bytes() const { return (from.capacity() + to.capacity()) * sizeof(Vec3d); }
  };
  // Of all features of a body that meets itself.
  struct FeatureBoxes {
    std::vector<Box> vertices, edges;

    void fit(const Ways& ways);
  };
  // Some features of one body and their boxes, side by side; where there are many, sorted along x.
  struct BoxList {
    std::vector<std::uint32_t> features;
    std::array<std::vector<double>, 6> sides;
    std::vector<std::pair<std::uint32_t, Box>> unsorted;  // scratch
    double widest_m = 0.0;                                // along x; less than 0: they are not sorted

    void clear();
    void add(std::uint32_t feature, const Box& box);
    void arrange();
    /// Of the boxes that may overlap one along x: the first, and how many.
    [[nodiscard]] std::pair<std::size_t, std::size_t> window(double low_m, double high_m) const;
    [[nodiscard]] std::size_t bytes() const;
    [[nodiscard]] std::array<double, 6> box(std::size_t i) const {
      return {sides[0][i], sides[1][i], sides[2][i], sides[3][i], sides[4][i], sides[5][i]};
    }
    [[nodiscard]] BoxRows rows(std::size_t first, std::size_t count) const;
  };
  struct NearFeatures {
    BoxList vertices, edges, faces;

    void take(const Ways& ways, std::span<const FaceBox> near);
    [[nodiscard]] std::size_t bytes() const { return vertices.bytes() + edges.bytes() + faces.bytes(); }
  };
  static Ways ways_of(const SurfaceBody& body) { return {&body, body.from, body.to, body.way, body.margin_m}; }
  /// With the margin too: what touches or is flat crosses by its last digits.
  static Ways start_of(const SurfaceBody& body) {
    const Vec3d margin = Vec3d::Constant(body.margin_m);
    return {&body, body.from, body.from, {body.at.low - margin, body.at.high + margin}, body.margin_m};
  }
  [[nodiscard]] std::pair<Ways, Ways> ways_of(const SurfacePair& pair, std::span<const SurfaceBody> bodies);
  void take_near_faces(const Ways& a, const Ways& b);
  static void see_faces(const Ways& ways, std::span<FaceBox> near);
  static void sort_by_low(std::vector<FaceBox>& faces);
  void meet_self(std::uint32_t f, std::uint32_t g, const SurfaceBody& body, std::vector<Candidate>& candidates);
  void meet_near_faces(SurfacePair& pair, const Ways& ways_a, const Ways& ways_b);
  void add_near_faces(SurfacePair& pair, const Ways& ways_a, std::span<const FaceBox> near_a, const Ways& ways_b,
                      std::span<const FaceBox> near_b);
  /// False where none is left.
  [[nodiscard]] bool take_looks(std::size_t count) {
    looks_left_ -= std::min(looks_left_, count);
    return looks_left_ > 0;
  }
  template <class Add>
  void for_overlapping(const BoxList& firsts, const BoxList& seconds, const Add& add);
  /// Until one visit returns false.
  template <class Visit>
  void for_near_faces(const Visit& visit);
  static void take_near_faces(const Ways& ways, const Vec3d& towards, double least_m, const Box& region,
                              std::vector<double>& heights_m, std::vector<FaceBox>& near);

  SeenWays seen_a_, seen_b_;
  std::size_t looks_left_ = std::numeric_limits<std::size_t>::max();
  std::vector<double> heights_m_;
  std::vector<FaceBox> near_a_, near_b_, astray_;
  FeatureBoxes boxes_;
  NearFeatures features_a_, features_b_;
  std::vector<std::uint32_t> overlapping_;
  const FeatureKernels* kernels_ = &feature_kernels(isa_in_use());
};

}  // namespace pneuma::physics
