// Surfaces on their way through one substep, as contact of surfaces sees them, without a world around them.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "physics/contact/candidates.h"
#include "physics/contact/feature_measures.h"
#include "physics/contact/surface_body.h"
#include "physics/contact/surface_rows.h"
#include "support/crossings.h"

namespace pneuma::physics {

inline Vec3d random_vector(std::mt19937& random, double largest) {
  std::uniform_real_distribution<double> coordinate(-largest, largest);
  const double x = coordinate(random);
  const double y = coordinate(random);
  return {x, y, coordinate(random)};
}

/// At rest, turned askew: no feature lies along one of another body.
inline SurfaceBody askew_surface(std::shared_ptr<const Mesh> mesh, const Vec3d& position_m, unsigned seed,
                                 double shell_m) {
  std::mt19937 random(seed);
  const Eigen::AngleAxisd turn(1.0 + 0.1 * seed, random_vector(random, 1.0).normalized());
  SurfaceBody body;
  body.spacing_m = diagonal_m(mesh->positions_m) / std::sqrt(static_cast<double>(mesh->positions_m.size()));
  body.shell_m = shell_m;
  for (const Vec3d& x : mesh->positions_m) body.from.push_back(position_m + turn * x);
  body.topology = make_surface_topology(std::move(mesh));
  body.to = body.from;
  body.inverse_masses_1_kg.assign(body.from.size(), 1.0);
  body.cuts.assign(body.from.size(), 1.0);
  return body;
}

/// What candidates are found by, after `from` or `to` have changed.
inline void fit_way(SurfaceBody& body) {
  body.margin_m = (1.0 + row_slack_share) * body.shell_m + body.slack_m;
  body.boxed_to = body.to;
  body.at = {};
  for (const Vec3d& at : body.from) body.at.include(at);
  body.way = body.at;
  for (const Vec3d& at : body.to) body.way.include(at);
  body.way.low -= Vec3d::Constant(body.margin_m);
  body.way.high += Vec3d::Constant(body.margin_m);
}

/// Each two bodies, and each with itself where `with_selves`, with their candidates.
inline std::vector<SurfacePair> all_pairs(std::span<SurfaceBody> bodies, bool with_selves) {
  for (SurfaceBody& body : bodies) fit_way(body);
  CandidateFinder finder;
  std::vector<SurfacePair> pairs;
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    for (std::uint32_t j = with_selves ? i : i + 1; j < bodies.size(); ++j) {
      SurfacePair& pair = pairs.emplace_back(SurfacePair{i, j});
      finder.find(pair, bodies);
      FeatureMeasures().measure(pair, bodies);
    }
  }
  return pairs;
}

inline support::TriangleMesh triangles_of(const SurfaceBody& body) {
  return {body.from, body.topology->mesh->faces};
}

/// Of two features, not measured.
inline Candidate make_candidate(FeaturePair kind, bool swapped, std::uint32_t first, std::uint32_t second,
                                const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  const Mesh& of_first = *bodies[swapped ? pair.second : pair.first].topology->mesh;
  const Mesh& of_second = *bodies[swapped ? pair.first : pair.second].topology->mesh;
  if (kind == FeaturePair::vertex_face) {
    const auto& [a, b, c] = of_second.faces[second];
    return {kind, swapped, first, second, {first, a, b, c}};
  }
  const Edge& edge = of_first.edges[first];
  const Edge& other = of_second.edges[second];
  return {kind, swapped, first, second, {edge[0], edge[1], other[0], other[1]}};
}

}  // namespace pneuma::physics
