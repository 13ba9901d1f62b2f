#include "physics/contact/touch_groups.h"

#include "physics/contact/surface_shell.h"
#include "physics/rigid/rigid_contacts.h"
#include "physics/scene/shape_parts.h"

namespace pneuma::physics {
namespace {

// Bodies this share of their lengths apart, beyond the reach of their contacts, still belong to one group.
constexpr double group_gap_share = 1e-3;

bool may_touch(const Extent& a, const Extent& b) {
  if (a.tie != 0 && a.tie == b.tie) return true;
  if (!a.rigid && !b.rigid && !(a.meets_soft && b.meets_soft)) return false;
  const double gap_m = a.reach_m + b.reach_m;
  return ((a.box.min.array() <= b.box.max.array() + gap_m) && (b.box.min.array() <= a.box.max.array() + gap_m)).all();
}

}  // namespace

template <class Real>
Extent extent_of(const SoftState<Real>& body) {
  const Aabb<Real> box = fit_aabb<Real>(body.x);
  const double length_m = static_cast<double>(body.length_m);
  return {.counts = true,
          .meets_soft = body.body.collision.soft != SoftCollision::none,
          .tie = body.tie,
          .box = {body.origin_m + box.min.template cast<double>(), body.origin_m + box.max.template cast<double>()},
          .reach_m = shell_m(body) + group_gap_share * length_m};
}

Extent extent_of(const RigidState& body) {
  const double radius_m = radius_about_centre(body.body.shape);
  const Eigen::Matrix3d rotation = body.orientation.toRotationMatrix();
  const Vec3d half = of_rigid_shape(body.body.shape, Vec3d(Vec3d::Zero()), [&](const auto& rigid, const auto& shape) {
    return rigid.half_box_m(shape, rotation);
  });
  return {.counts = true,
          .rigid = true,
          .tie = body.tie,
          .box = {body.position - half, body.position + half},
          .reach_m = body.body.surface.thickness_m + group_gap_share * 2.0 * radius_m};
}

std::vector<std::size_t> take_group(std::span<Extent> extents, std::size_t first) {
  std::vector<std::size_t> group{first};
  extents[first].counts = false;
  for (std::size_t k = 0; k < group.size(); ++k) {
    const Extent& one = extents[group[k]];
    for (std::size_t i = 0; i < extents.size(); ++i) {
      if (!extents[i].counts || !may_touch(one, extents[i])) continue;
      extents[i].counts = false;
      group.push_back(i);
    }
  }
  return group;
}

template <class Real>
void wake(SoftState<Real>& body) {
  body.rest = {};
  body.place.clear();
}

void wake(RigidState& body) {
  body.rest = {};
}

template <class Real>
std::vector<std::size_t> wake_group(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, std::size_t body) {
  const bool asleep = body < soft.size() ? soft[body].rest.asleep : rigid[body - soft.size()].rest.asleep;
  std::vector<std::size_t> group{body};
  if (asleep) {
    std::vector<Extent> extents = extents_of<Real>(soft, rigid, [](const auto& one) { return one.rest.asleep; });
    group = take_group(extents, body);
  }
  for (const std::size_t i : group) {
    if (i < soft.size()) {
      wake(soft[i]);
    } else {
      wake(rigid[i - soft.size()]);
    }
  }
  return group;
}

#define PNEUMA_INSTANTIATE(Real)                     \
  template Extent extent_of(const SoftState<Real>&); \
  template void wake<Real>(SoftState<Real>&);        \
  template std::vector<std::size_t> wake_group<Real>(std::span<SoftState<Real>>, std::span<RigidState>, std::size_t);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
