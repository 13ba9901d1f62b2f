#include "physics/contact/contact_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/limits.h"
#include "physics/lanes/body_extents.h"
#include "physics/rigid/sweep.h"

namespace pneuma::physics {
namespace {

// Below this share of its cube, an inertia's determinant is round-off: the vertices are on a line.
constexpr double turning_share_min = 1e-12;

template <class Real>
Aabb<double> box_of(const Span<Real> (&spans)[3], const Vec3d& origin_m) {
  Aabb<double> box;
  for (std::size_t k = 0; k < 3; ++k) {
    box.min[static_cast<Eigen::Index>(k)] = static_cast<double>(spans[k].low);
    box.max[static_cast<Eigen::Index>(k)] = static_cast<double>(spans[k].high);
  }
  return {origin_m + box.min, origin_m + box.max};
}

bool within_limits(const Aabb<double>& box) {
  return (box.min.array() >= -base::coordinate_max_m).all() && (box.max.array() <= base::coordinate_max_m).all();
}

bool overlap(const Aabb<double>& a, const Aabb<double>& b, double grown_m) {
  return ((a.min.array() <= b.max.array() + grown_m) && (b.min.array() <= a.max.array() + grown_m)).all();
}

}  // namespace

template <class Real>
void fit_boxes(const SoftState<Real>& body, BodyBounds& bounds) {
  fit_boxes(body, extents_of(body), bounds);
}

template <class Real>
void fit_boxes(const SoftState<Real>& body, const Extents<Real>& extents, BodyBounds& bounds) {
  bounds.start = box_of(extents.x, body.origin_m);
  bounds.moved = box_of(extents.end, body.origin_m);
  bounds.swept = {bounds.start.min.cwiseMin(bounds.moved.min), bounds.start.max.cwiseMax(bounds.moved.max)};
  bounds.active = within_limits(bounds.swept);
  bounds.stale = false;
}

template <class Real>
Vec3d mean_velocity(const SoftState<Real>& body) {
  Vec3d sum = Vec3d::Zero();
  double free = 0.0;  // in vertices of the mean mass, here and below
  body.with_mass_shares([&](auto share) {
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      if (body.is_pinned(i)) continue;
      sum += share(i) * body.v[i].template cast<double>();
      free += share(i);
    }
  });
  return free == 0.0 ? sum : Vec3d(sum / free);
}

template <class Real>
void fit_rigid(const SoftState<Real>& body, RigidPart& rigid) {
  const Vec3d near = body.x.front().template cast<double>();  // so that far from the origin no digits are lost
  Vec3d arms = Vec3d::Zero();
  double free = 0.0;
  body.with_mass_shares([&](auto share) {
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      if (body.is_pinned(i)) continue;
      arms += share(i) * (body.x[i].template cast<double>() - near);
      free += share(i);
    }
  });
  rigid.mass_kg = free * static_cast<double>(body.vertex_mass_kg);
  rigid.centre = body.origin_m + (near + (free == 0.0 ? 0.0 : 1.0 / free) * arms);
  rigid.velocity = mean_velocity(body);
}

template <class Real>
void fit_means(const SoftState<Real>& body, BodyBounds& bounds) {
  fit_rigid(body, bounds.rigid);
  Vec3d moves = Vec3d::Zero();
  std::size_t free = 0;
  for (std::size_t i = 0; i < body.x.size(); ++i) {
    if (body.is_pinned(i)) continue;
    moves += body.dr[i].template cast<double>();
    ++free;
  }
  bounds.mean_move = free == 0 ? moves : Vec3d((1.0 / static_cast<double>(free)) * moves);

  // A body about to be frozen must not take others with it.
  bounds.active = bounds.active && bounds.rigid.velocity.norm() <= base::speed_max_m_s && bounds.mean_move.allFinite();

  bounds.ellipsoid = {0.5 * (bounds.moved.min + bounds.moved.max), 0.5 * (bounds.moved.max - bounds.moved.min)};
  if (body.body.collision.bounds != BoundsKind::ball) return;
  Vec3d centre = Vec3d::Zero();
  for (std::size_t i = 0; i < body.x.size(); ++i) centre += (body.x[i] + body.dr[i]).template cast<double>();
  centre /= static_cast<double>(body.x.size());
  double furthest = 0.0;
  for (std::size_t i = 0; i < body.x.size(); ++i) {
    furthest = std::max(furthest, ((body.x[i] + body.dr[i]).template cast<double>() - centre).squaredNorm());
  }
  bounds.ellipsoid = {body.origin_m + centre, Vec3d::Constant(std::sqrt(furthest))};
}

template <class Real>
void fit_turning(const SoftState<Real>& body, RigidPart& rigid) {
  if (rigid.turning_is_known) return;
  rigid.turning_is_known = true;
  Vec3d spin = Vec3d::Zero();
  Vec3d squares = Vec3d::Zero();   // xx, yy, zz of the arms
  Vec3d products = Vec3d::Zero();  // xy, yz, zx
  body.with_mass_shares([&](auto share) {
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      if (body.is_pinned(i)) continue;
      const Vec3d arm = body.position_m(i) - rigid.centre;
      spin += share(i) * arm.cross(body.v[i].template cast<double>());
      squares += share(i) * arm.cwiseProduct(arm);
      products += share(i) * arm.cwiseProduct(Vec3d(arm.y(), arm.z(), arm.x()));
    }
  });
  const double size = squares.sum();
  Eigen::Matrix3d inertia;                                      // over the mean mass, as the spin is
  inertia << size - squares.x(), -products.x(), -products.z(),  //
      -products.x(), size - squares.y(), -products.y(),         //
      -products.z(), -products.y(), size - squares.z();
  if (!(inertia.determinant() > turning_share_min * size * size * size)) return;
  const Eigen::Matrix3d inverse = inertia.inverse();
  rigid.inverse_inertia_1_kg_m2 = inverse / static_cast<double>(body.vertex_mass_kg);
  rigid.angular_velocity = inverse * spin;
}

template <class Real>
void find_soft_pairs(std::span<const SoftState<Real>> soft, std::span<const BodyBounds> bounds,
                     std::vector<std::uint32_t>& order, std::vector<SoftPair>& pairs) {
  order.clear();
  pairs.clear();
  for (std::uint32_t i = 0; i < soft.size(); ++i) {
    if (bounds[i].active && soft[i].body.collision.soft != SoftCollision::none) order.push_back(i);
  }
  double thickest_m = 0.0;
  for (const std::uint32_t i : order) thickest_m = std::max(thickest_m, soft[i].body.surface.thickness_m);
  sort_and_sweep(
      order, [&](std::uint32_t i) { return bounds[i].swept.min.x(); },
      [&](std::uint32_t i) { return bounds[i].swept.max.x() + 2.0 * thickest_m; },
      [&](std::uint32_t a, std::uint32_t b) {
        if (!soft[a].is_awake() && !soft[b].is_awake()) return;
        const double grown_m = soft[a].body.surface.thickness_m + soft[b].body.surface.thickness_m;
        if (!overlap(bounds[a].swept, bounds[b].swept, grown_m)) return;
        pairs.push_back({.a = a, .b = b});
        pairs.push_back({.a = b, .b = a});
      });
  std::ranges::sort(pairs, [](const SoftPair& p, const SoftPair& q) { return p.a != q.a ? p.a < q.a : p.b < q.b; });
}

template void fit_boxes(const SoftState<float>&, BodyBounds&);
template void fit_boxes(const SoftState<double>&, BodyBounds&);
template void fit_boxes(const SoftState<float>&, const Extents<float>&, BodyBounds&);
template void fit_boxes(const SoftState<double>&, const Extents<double>&, BodyBounds&);
template Vec3d mean_velocity(const SoftState<float>&);
template Vec3d mean_velocity(const SoftState<double>&);
template void fit_rigid(const SoftState<float>&, RigidPart&);
template void fit_rigid(const SoftState<double>&, RigidPart&);
template void fit_means(const SoftState<float>&, BodyBounds&);
template void fit_means(const SoftState<double>&, BodyBounds&);
template void fit_turning(const SoftState<float>&, RigidPart&);
template void fit_turning(const SoftState<double>&, RigidPart&);
template void find_soft_pairs(std::span<const SoftState<float>>, std::span<const BodyBounds>,
                              std::vector<std::uint32_t>&, std::vector<SoftPair>&);
template void find_soft_pairs(std::span<const SoftState<double>>, std::span<const BodyBounds>,
                              std::vector<std::uint32_t>&, std::vector<SoftPair>&);

}  // namespace pneuma::physics
