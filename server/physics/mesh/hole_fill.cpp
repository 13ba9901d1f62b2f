#include "physics/mesh/hole_fill.h"

#include <Eigen/Geometry>

namespace pneuma::physics {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double cross(const Vector2d& a, const Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Newell: twice the area that the border spans, along its mean normal.
Vector3d area_vector_m2(std::span<const Vector3d> corners) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    sum += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
  }
  return sum;
}

/// A border in its plane, from which ears are cut one after another.
class Ears {
 public:
  Ears(std::span<const std::uint32_t> border, std::span<const Vector3d> corners, const Vector3d& normal,
       double area_min_m2, const EdgeSet& edges)
      : border_(border), twice_area_min_m2_(2.0 * area_min_m2), edges_(edges), places_(border.size()) {
    const Vector3d along = normal.unitOrthogonal();
    const Vector3d across = normal.cross(along);
    const std::size_t count = border.size();
    for (std::size_t i = 0; i < count; ++i) {
      const Vector3d from_first = corners[i] - corners[0];
      Place& place = places_[i];
      place.at = {from_first.dot(along), from_first.dot(across)};
      place.before = (i + count - 1) % count;
      place.after = (i + 1) % count;
    }
    for (std::size_t i = 0; i < count; ++i) look_at(i);
  }

  /// The face that was cut off; nothing where there is no ear.
  std::optional<Face> cut() {
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      if (places_[i].state == State::ear && (!best || new_edge_m2(i) < new_edge_m2(*best))) best = i;
    }
    if (!best) return std::nullopt;
    Place& ear = places_[*best];
    const Face face{border_[ear.before], border_[*best], border_[ear.after]};
    ear.state = State::cut;
    places_[ear.before].after = ear.after;
    places_[ear.after].before = ear.before;
    --left_;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      if (places_[i].state == State::blocked && places_[i].blocker == *best) look_at(i);
    }
    look_at(ear.before);
    look_at(ear.after);
    return face;
  }

 private:
  enum class State { ear, blocked, no_ear, cut };
  struct Place {
    Vector2d at;
    std::size_t before = 0;
    std::size_t after = 0;
    State state = State::no_ear;
    std::size_t blocker = 0;  // of the blocked: a vertex within the ear
  };

  [[nodiscard]] double new_edge_m2(std::size_t i) const {
    return (places_[places_[i].after].at - places_[places_[i].before].at).squaredNorm();
  }

  void look_at(std::size_t i) {
    Place& place = places_[i];
    const std::size_t before = place.before;
    const std::size_t after = place.after;
    const Vector2d& a = places_[before].at;
    const Vector2d& b = place.at;
    const Vector2d& c = places_[after].at;
    place.state = State::no_ear;
    if (!(cross(b - a, c - a) > twice_area_min_m2_)) return;
    if (left_ > 3 && edges_.contains(border_[before], border_[after])) return;
    // On a side counts as within: cut all the same, that vertex would be left in line with its neighbours.
    for (std::size_t p = places_[after].after; p != before; p = places_[p].after) {
      const Vector2d& at = places_[p].at;
      if (cross(b - a, at - a) < -twice_area_min_m2_ || cross(c - b, at - b) < -twice_area_min_m2_ ||
          cross(a - c, at - c) < -twice_area_min_m2_) {
        continue;
      }
      place.state = State::blocked;
      place.blocker = p;
      return;
    }
    place.state = State::ear;
  }

  std::span<const std::uint32_t> border_;
  double twice_area_min_m2_;
  const EdgeSet& edges_;
  std::vector<Place> places_;
  std::size_t left_ = places_.size();
};

}  // namespace

std::optional<std::vector<Face>> fill_hole(std::span<const Vector3d> positions_m, std::span<const std::uint32_t> border,
                                           double area_min_m2, EdgeSet& edges) {
  std::vector<Vector3d> corners;
  corners.reserve(border.size());
  for (const std::uint32_t vertex : border) corners.push_back(positions_m[vertex]);
  const Vector3d area_m2 = area_vector_m2(corners);
  if (!(area_m2.norm() > 2.0 * area_min_m2)) return std::nullopt;

  std::vector<Face> faces;
  faces.reserve(border.size() - 2);
  Ears ears(border, corners, area_m2.normalized(), area_min_m2, edges);
  while (faces.size() + 2 < border.size()) {
    const std::optional<Face> face = ears.cut();
    if (!face) return std::nullopt;
    faces.push_back(*face);
  }
  for (const Face& face : faces) edges.insert(face[0], face[2]);
  return faces;
}

}  // namespace pneuma::physics
