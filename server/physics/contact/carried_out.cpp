#include "physics/contact/carried_out.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <variant>

#include "physics/contact/contact_bounds.h"
#include "physics/contact/surface_shell.h"
#include "physics/rigid/contact_surface.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {
namespace {

// Vertices that are deeper than this share of their spacing are deeper than rows leave them.
constexpr double deep_share = 0.01;
// The depth of a body is left within this time, at no more than this speed.
constexpr double out_time_s = 0.3;
constexpr double out_speed_max_m_s = 1.0;
// The ways out of vertices agree where their sum is as long as this share of them, each by itself.
constexpr double agreed_share = 0.5;
// A way out of a vertex is along the body's by this much at least.
constexpr double along_min = 0.5;
// A body in a corner has a few walls to leave.
constexpr int rounds = 4;

/// A way out of a solid.
struct WayOut {
  Vec3d normal = Vec3d::Zero();  // unit
  double depth_m = 0.0;
};

struct PlacedSolid {
  Frame frame;
  const Shape* shape = nullptr;
  const Surface* surface = nullptr;
};

template <class Real>
Aabb<double> box_in(const Frame& frame, const SoftState<Real>& body) {
  const Eigen::Matrix3d to_local = frame.rotation.transpose();
  const Vec3d origin = to_local * (body.origin_m - frame.origin);
  const auto place = [&](std::size_t i) { return Vec3d(origin + to_local * body.x[i].template cast<double>()); };
  Aabb<double> box{place(0), place(0)};
  for (std::size_t i = 1; i < body.x.size(); ++i) {
    const Vec3d at = place(i);
    box = {box.min.cwiseMin(at), box.max.cwiseMax(at)};
  }
  return box;
}

// Whether a point of the box, in the shape's frame, may be deeper than that in the shape.
bool may_be_deep(const Shape& shape, const Aabb<double>& box, double offset_m, double deep_m) {
  if (const auto* room = std::get_if<RoomShape>(&shape)) {
    const Vec3d furthest = box.min.cwiseAbs().cwiseMax(box.max.cwiseAbs());
    return (furthest.array() > room->half_extents_m.array() - offset_m + deep_m).any();
  }
  const Vec3d middle = 0.5 * (box.min + box.max);
  const Vec3d half = 0.5 * (box.max - box.min);
  if (const auto* plane = std::get_if<PlaneShape>(&shape))
    return plane->normal.dot(middle) - plane->normal.cwiseAbs().dot(half) < offset_m - deep_m;
  const Vec3d outer = half_extents_m(shape).array() + (offset_m - deep_m);
  return ((middle.cwiseAbs() - half).array() < outer.array()).all();
}

/// About a box of the world.
Aabb<double> box_in(const Frame& frame, const Aabb<double>& box) {
  const Vec3d middle = frame.to_local(0.5 * (box.min + box.max));
  const Vec3d half = frame.rotation.transpose().cwiseAbs() * (0.5 * (box.max - box.min));
  return {middle - half, middle + half};
}

template <class Real>
std::optional<WayOut> way_out(const SoftState<Real>& body, const Aabb<double>& box, const PlacedSolid& solid) {
  const double offset_m = combine(body.body.surface, *solid.surface).thickness_m;
  const double deep_m = deep_share * spacing_m(body);
  if (!may_be_deep(*solid.shape, box_in(solid.frame, box), offset_m, deep_m) ||
      !may_be_deep(*solid.shape, box_in(solid.frame, body), offset_m, deep_m))
    return {};
  Vec3d sum = Vec3d::Zero();
  double depths_m = 0.0;
  std::vector<WayOut> deep;
  for (std::size_t i = 0; i < body.x.size(); ++i) {
    const SurfacePoint at = nearest_surface(*solid.shape, solid.frame.to_local(body.position_m(i)), offset_m);
    if (at.distance_m >= -deep_m) continue;
    deep.push_back({solid.frame.rotation * at.normal, -at.distance_m});
    sum += deep.back().depth_m * deep.back().normal;
    depths_m += deep.back().depth_m;
  }
  if (deep.empty() || sum.norm() < agreed_share * depths_m) return {};
  WayOut way{sum.normalized(), 0.0};
  for (const WayOut& of : deep)
    way.depth_m = std::max(way.depth_m, of.depth_m / std::max(along_min, of.normal.dot(way.normal)));
  return way;
}

struct Overlap {
  std::size_t soft = 0;
  std::optional<std::size_t> rigid;  // that yields
  Vec3d normal = Vec3d::Zero();
  double speed_m_s = 0.0;
};

template <class Real>
std::vector<Overlap> find_overlaps(std::span<const SoftState<Real>> soft, std::span<const RigidState> rigid,
                                   std::span<const ColliderState> colliders) {
  std::vector<Overlap> overlaps;
  Aabb<double> box;  // of the soft body
  const auto look = [&](std::size_t s, const PlacedSolid& solid, std::optional<std::size_t> yielding) {
    const auto way = way_out(soft[s], box, solid);
    if (!way) return;
    overlaps.push_back({s, yielding, way->normal, std::min(way->depth_m / out_time_s, out_speed_max_m_s)});
  };
  for (std::size_t s = 0; s < soft.size(); ++s) {
    if (!soft[s].is_awake() || !soft[s].pinned.empty()) continue;
    box = box_in(Frame(), soft[s]);
    for (std::size_t r = 0; r < rigid.size(); ++r) {
      if (rigid[r].frozen) continue;
      const bool yields = rigid[r].is_awake() && is_active(rigid[r]);
      const PlacedSolid solid{Frame(rigid[r].position, rigid[r].orientation), &rigid[r].body.shape,
                              &rigid[r].body.surface};
      look(s, solid, yields ? std::optional(r) : std::nullopt);
    }
    for (const ColliderState& state : colliders) {
      if (state.tree != nullptr) continue;  // a mesh has ways out of its own (mesh_colliders.h)
      look(s, {Frame(state.position, state.orientation), &state.collider.shape, &state.collider.surface}, {});
    }
  }
  return overlaps;
}

Vec3d no_faster(const Vec3d& velocity_m_s) {
  const double speed_m_s = velocity_m_s.norm();
  return speed_m_s > out_speed_max_m_s ? Vec3d(out_speed_max_m_s / speed_m_s * velocity_m_s) : velocity_m_s;
}

template <class Real>
void add_to_all(SoftState<Real>& body, const Vec3d& velocity_m_s) {
  const Vec3<Real> added = velocity_m_s.template cast<Real>();
  for (Vec3<Real>& v : body.v) v += added;
}

// What is left of it. Contact or a joint may have stopped the body beside a fixed solid, and it is not to go back for
// that.
Vec3d left_of(const Vec3d& carried_m_s, const Vec3d& velocity_m_s) {
  const double speed_m_s = carried_m_s.norm();
  if (speed_m_s == 0.0) return Vec3d::Zero();
  const Vec3d along = carried_m_s / speed_m_s;
  return std::clamp(velocity_m_s.dot(along), 0.0, speed_m_s) * along;
}

Vec3d apart_m_s(const Overlap& of, std::span<const Vec3d> velocities_m_s, std::size_t soft_count) {
  return velocities_m_s[of.soft] - (of.rigid ? velocities_m_s[soft_count + *of.rigid] : Vec3d(Vec3d::Zero()));
}

}  // namespace

template <class Real>
void CarriedOut<Real>::begin(std::span<SoftState<Real>> soft, std::span<RigidState> rigid,
                             std::span<const ColliderState> colliders) {
  velocities_m_s_.clear();
  if (rigid.empty() && colliders.empty()) return;
  const std::vector<Overlap> overlaps = find_overlaps<Real>(soft, rigid, colliders);
  if (overlaps.empty()) return;
  velocities_m_s_.assign(soft.size() + rigid.size(), Vec3d::Zero());
  leaves_fixed_.assign(soft.size(), 1);
  for (const Overlap& of : overlaps) {
    if (of.rigid) leaves_fixed_[of.soft] = 0;
  }
  for (int round = 0; round < rounds; ++round) {
    for (const Overlap& of : overlaps) {
      const double lacking_m_s = of.speed_m_s - of.normal.dot(apart_m_s(of, velocities_m_s_, soft.size()));
      if (lacking_m_s <= 0.0) continue;
      const double soft_1_kg = 1.0 / soft[of.soft].body.mass_kg;
      const Vec3d solid_1_kg = of.rigid ? inverse_masses_1_kg(rigid[*of.rigid]) : Vec3d(Vec3d::Zero());
      const Vec3d yielding = solid_1_kg.cwiseProduct(of.normal);
      const double impulse_n_s = lacking_m_s / (soft_1_kg + of.normal.dot(yielding));
      velocities_m_s_[of.soft] += impulse_n_s * soft_1_kg * of.normal;
      if (of.rigid) velocities_m_s_[soft.size() + *of.rigid] -= impulse_n_s * yielding;
    }
  }
  for (Vec3d& velocity : velocities_m_s_) velocity = no_faster(velocity);
  for (const Overlap& of : overlaps) {  // between walls there is no way out of both
    if (of.normal.dot(apart_m_s(of, velocities_m_s_, soft.size())) < 0.0) velocities_m_s_[of.soft].setZero();
  }
  for (std::size_t s = 0; s < soft.size(); ++s) add_to_all(soft[s], velocities_m_s_[s]);
  for (std::size_t r = 0; r < rigid.size(); ++r) rigid[r].velocity += velocities_m_s_[soft.size() + r];
}

template <class Real>
void CarriedOut<Real>::end(std::span<SoftState<Real>> soft, std::span<RigidState> rigid) {
  if (velocities_m_s_.empty()) return;
  for (std::size_t s = 0; s < soft.size(); ++s) {
    if (!soft[s].is_awake()) continue;
    const Vec3d carried_m_s = velocities_m_s_[s];
    add_to_all(soft[s], Vec3d(leaves_fixed_[s] != 0 ? -left_of(carried_m_s, mean_velocity(soft[s])) : -carried_m_s));
  }
  for (std::size_t r = 0; r < rigid.size(); ++r) {
    if (rigid[r].is_awake()) rigid[r].velocity -= velocities_m_s_[soft.size() + r];
  }
  velocities_m_s_.clear();
}

template class CarriedOut<float>;
template class CarriedOut<double>;

}  // namespace pneuma::physics
