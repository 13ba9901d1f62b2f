#include "physics/contact/closest.h"

#include <algorithm>
#include <cmath>

namespace pneuma::physics {
namespace {

// Of the margin: an advance that gains less than this has arrived.
constexpr double advance_share_min = 0.05;
// Halvings of the distance take a handful of rounds; a grazing pass takes more.
constexpr int advances_max = 64;

struct SegmentPoint {
  double along = 0.0;
  double squared_m2 = 0.0;
};

SegmentPoint nearest_of_segment(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const Vec3d way = b - a;
  const double squared = way.squaredNorm();
  const double along = squared > 0.0 ? std::clamp(way.dot(p - a) / squared, 0.0, 1.0) : 0.0;
  return {along, (p - a - along * way).squaredNorm()};
}

}  // namespace

FacePoint nearest_of_face(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  FacePoint nearest;
  double best_m2 = std::numeric_limits<double>::infinity();
  const std::array<const Vec3d*, 3> corners{&a, &b, &c};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3;
    const SegmentPoint on_edge = nearest_of_segment(p, *corners[i], *corners[next]);
    if (on_edge.squared_m2 >= best_m2) continue;
    best_m2 = on_edge.squared_m2;
    nearest.weights = {};
    nearest.weights[i] = on_edge.along > 1.0 - share_min ? 0.0 : 1.0 - on_edge.along;
    nearest.weights[next] = 1.0 - nearest.weights[i];
    if (nearest.weights[next] < share_min) {
      nearest.weights[i] = 1.0;
      nearest.weights[next] = 0.0;
    }
  }
  const Vec3d normal = (b - a).cross(c - a);
  const double squared = normal.squaredNorm();
  if (squared > 0.0) {
    const double of_b = normal.dot((p - a).cross(c - a)) / squared;
    const double of_c = normal.dot((b - a).cross(p - a)) / squared;
    const double of_a = 1.0 - of_b - of_c;
    const double above = normal.dot(p - a);
    const double above_m2 = above * above / squared;
    if (of_a > share_min && of_b > share_min && of_c > share_min && above_m2 < best_m2) {
      nearest.weights = {of_a, of_b, of_c};
      best_m2 = above_m2;
    }
  }
  nearest.distance_m = std::sqrt(best_m2);
  return nearest;
}

EdgePoints nearest_of_edges(const Vec3d& a0, const Vec3d& a1, const Vec3d& b0, const Vec3d& b1) {
  EdgePoints nearest;
  double best_m2 = std::numeric_limits<double>::infinity();
  const auto try_end = [&](const SegmentPoint& point, double along_first, double along_second) {
    if (point.squared_m2 >= best_m2) return;
    best_m2 = point.squared_m2;
    nearest = {along_first, along_second, 0.0, false};
  };
  for (const double end : {0.0, 1.0}) {
    const SegmentPoint on_second = nearest_of_segment(end == 0.0 ? a0 : a1, b0, b1);
    try_end(on_second, end, on_second.along);
    const SegmentPoint on_first = nearest_of_segment(end == 0.0 ? b0 : b1, a0, a1);
    try_end(on_first, on_first.along, end);
  }
  const Vec3d first = a1 - a0;
  const Vec3d second = b1 - b0;
  const Vec3d apart = a0 - b0;
  const double aa = first.squaredNorm();
  const double bb = second.squaredNorm();
  const double ab = first.dot(second);
  const double determinant = aa * bb - ab * ab;
  if (determinant > parallel_share * aa * bb) {
    const double of_first = first.dot(apart);
    const double of_second = second.dot(apart);
    const double along_first = (ab * of_second - bb * of_first) / determinant;
    const double along_second = (aa * of_second - ab * of_first) / determinant;
    const auto inside = [](double along) { return along > share_min && along < 1.0 - share_min; };
    if (inside(along_first) && inside(along_second)) {
      const double squared = (apart + along_first * first - along_second * second).squaredNorm();
      if (squared < best_m2) {
        best_m2 = squared;
        nearest = {along_first, along_second, 0.0, true};
      }
    }
  }
  nearest.distance_m = std::sqrt(best_m2);
  return nearest;
}

double distance_m(FeaturePair pair, const FourPoints& points) {
  const auto& [p, a, b, c] = points;
  return pair == FeaturePair::vertex_face ? nearest_of_face(p, a, b, c).distance_m
                                          : nearest_of_edges(p, a, b, c).distance_m;
}

namespace {

// From its plane and, beside it, from the line of the edge that the point is furthest beyond.
double vertex_face_bound_m(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d ab = b - a;
  const Vec3d bc = c - b;
  const Vec3d ca = a - c;
  const Vec3d normal = ab.cross(-ca);
  const double squared = normal.squaredNorm();
  if (!(squared > parallel_share * ab.squaredNorm() * ca.squaredNorm())) return 0.0;  // its direction is round-off
  const double above = normal.dot(p - a);
  const auto beyond = [&](const Vec3d& edge, const Vec3d& start) {
    const double outside = normal.dot((p - start).cross(edge));
    return outside > 0.0 ? outside * outside / edge.squaredNorm() : 0.0;
  };
  const double beside = std::max({beyond(ab, a), beyond(bc, b), beyond(ca, c)});
  return std::sqrt((above * above + beside) / squared);
}

// Between their lines and, along each, from its end to where it is nearest to the other's line.
double edge_edge_bound_m(const Vec3d& a0, const Vec3d& a1, const Vec3d& b0, const Vec3d& b1) {
  const Vec3d first = a1 - a0;
  const Vec3d second = b1 - b0;
  const Vec3d across = first.cross(second);
  const double squared = across.squaredNorm();
  const double of_first = first.squaredNorm();
  const double of_second = second.squaredNorm();
  if (!(squared > parallel_share * of_first * of_second)) return 0.0;
  const Vec3d apart = b0 - a0;
  const double above = across.dot(apart);
  const auto beyond = [&](const Vec3d& other, double other_squared) {
    const double along = across.dot(apart.cross(other));  // times `squared`
    const double outside = std::max({0.0, -along, along - squared});
    return outside * outside / other_squared;
  };
  return std::sqrt((above * above + std::max(beyond(second, of_second), beyond(first, of_first))) / squared);
}

}  // namespace

double distance_bound_m(FeaturePair pair, const FourPoints& at) {
  return pair == FeaturePair::vertex_face ? vertex_face_bound_m(at[0], at[1], at[2], at[3])
                                          : edge_edge_bound_m(at[0], at[1], at[2], at[3]);
}

double safe_share(FeaturePair pair, const FourPoints& start, const FourPoints& moves, double margin_m) {
  const double move_m = largest_relative_move_m(pair, moves);
  if (distance_bound_m(pair, start) - margin_m >= move_m) return 1.0;
  double gap_m = distance_m(pair, start) - margin_m;
  if (gap_m >= move_m) return 1.0;
  double share = 0.0;
  for (int advance = 0; advance < advances_max; ++advance) {
    if (gap_m <= advance_share_min * margin_m) return share;
    share += gap_m / move_m;
    if (share >= 1.0) return 1.0;
    FourPoints now = start;
    for (std::size_t i = 0; i < 4; ++i) now[i] += share * moves[i];
    gap_m = distance_m(pair, now) - margin_m;
  }
  return share;
}

}  // namespace pneuma::physics
