// What contact answered, for those who show it or wait for it.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "physics/scene/scene.h"

namespace pneuma::physics {

/// What a contact is with.
enum class BodyKind : std::uint8_t { soft, rigid, collider };

struct BodyRef {
  BodyKind kind = BodyKind::soft;
  std::uint32_t index = 0;  // among those of its kind
  auto operator<=>(const BodyRef&) const = default;
};

/// A vertex of a soft body that was held off something.
struct VertexContact {
  std::uint32_t vertex = 0;
  BodyRef other;
  Vec3d normal = Vec3d::Zero();  // unit, out of the other
};

/// Of one body; a vertex that was answered several times has several.
using ContactNotes = std::vector<VertexContact>;

/// Two that pressed each other in a tick.
struct BodyTouch {
  BodyRef first;  // before the second in order
  BodyRef second;
  double impulse_n_s = 0.0;        // along the normals, over the tick
  Vec3d push_n_s = Vec3d::Zero();  // what the first got from the second, friction included
  Vec3d position = Vec3d::Zero();  // m: the mean of where, by impulse
  Vec3d normal = Vec3d::Zero();    // out of the second: the mean, unit; 0 where the normals cancel
};

/// Adds up what contact answered in the substeps of a tick.
class TouchTally {
 public:
  void clear() { sums_.clear(); }
  /// What pushed the first at `position`, where `normal`, out of the second, is that of its surface. What does not
  /// press, what is no number (a body runs away), or what a body does to itself, is no touch.
  void add(BodyRef first, BodyRef second, const Vec3d& push_n_s, const Vec3d& position, const Vec3d& normal);
  /// By pair.
  [[nodiscard]] std::vector<BodyTouch> touches() const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Sum {
    double impulse_n_s = 0.0;
    Vec3d push_n_s = Vec3d::Zero();
    Vec3d position_n_s_m = Vec3d::Zero();
    Vec3d normal_n_s = Vec3d::Zero();
  };
  std::map<std::pair<BodyRef, BodyRef>, Sum> sums_;
};

}  // namespace pneuma::physics
