#include "physics/contact/span_solids.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "physics/contact/crowding.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/scene/shape_entry.h"
#include "physics/scene/shape_parts.h"

namespace pneuma::physics {
namespace {

// Of what the fastest of a body's vertices would go in the span: what is that near a solid has a row.
constexpr double reach_share = 1.3;

// A vertex that was missed and is no deeper than this share of its body's spacing is on the surface.
constexpr double on_surface_share = 1e-9;

// The walls that a point in the solid's frame is past: a bit each, as rows number them.
std::uint8_t walls_behind(const Shape& shape, const Vec3d& local, double offset_m) {
  if (const auto* plane = std::get_if<PlaneShape>(&shape)) return plane->normal.dot(local) < offset_m ? 1 : 0;
  const Vec3d inner = std::get<RoomShape>(shape).half_extents_m.array() - offset_m;
  unsigned walls = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    walls |= local[axis] < -inner[axis] ? 1U << (2 * axis) : local[axis] > inner[axis] ? 2U << (2 * axis) : 0U;
  }
  return static_cast<std::uint8_t>(walls);
}

// Whether all of a box may be told to be past none.
bool is_clear_of_walls(const Shape& shape, const Frame& at, const Box& box, double offset_m) {
  const Vec3d middle = at.to_local(0.5 * (box.low + box.high));
  const Vec3d half = at.rotation.transpose().cwiseAbs() * (0.5 * (box.high - box.low));
  if (const auto* plane = std::get_if<PlaneShape>(&shape)) {
    return plane->normal.dot(middle) - plane->normal.cwiseAbs().dot(half) >= offset_m;
  }
  return walls_behind(shape, middle.cwiseAbs() + half, offset_m) == 0;
}

}  // namespace

void SpanSolid::move(std::span<const RigidState> rigid, std::span<const ColliderState> colliders, double dt_s) {
  if (is_still && is_placed) return;
  is_placed = true;
  if (is_rigid) {
    const RigidState& state = rigid[index];
    at = {state.position, state.orientation};
    velocity = state.velocity;
    angular_velocity = state.angular_velocity;
  } else {
    const ColliderState& state = colliders[index];
    at = {state.position, state.orientation};
    velocity = state.collider.velocity;
    angular_velocity = state.collider.angular_velocity;
  }
  end = at;
  end.origin += dt_s * velocity;
  if (angular_velocity.isZero(0.0)) return;
  end.rotation = turned(Quatd(at.rotation), angular_velocity, dt_s).toRotationMatrix();
}

template <class Real>
void SpanSolids<Real>::take_solids(const ContactWorld<Real>& world) {
  solids_.clear();
  is_still_.clear();
  const auto take = [&](const auto& of_scene, bool is_rigid, std::uint32_t index, bool is_still) {
    SpanSolid& solid = solids_.emplace_back();
    solid.shape = &of_scene.shape;
    solid.surface = &of_scene.surface;
    solid.is_rigid = is_rigid;
    solid.index = index;
    solid.is_still = is_still;
    solid.move(world.rigid, world.colliders, world.substep.dt_s);
    solid.start = solid.at;
  };
  for (std::uint32_t r = 0; r < world.rigid.size(); ++r) take(world.rigid[r].body, true, r, false);
  for (std::uint32_t c = 0; c < world.colliders.size(); ++c) {
    const Collider& collider = world.colliders[c].collider;
    is_still_.push_back(is_moving(collider) ? 0 : 1);
    take(collider, false, c, is_still_[c] != 0);
  }
}

template <class Real>
void SpanSolids<Real>::find_rows(const ContactWorld<Real>& world, std::span<const SurfaceBody> surfaces,
                                 std::span<const std::uint32_t> soft, std::uint32_t first, double substeps,
                                 std::vector<ContactRow>& rows) {
  take_solids(world);
  const double span_s = substeps * world.substep.dt_s;
  places_.clear();
  for (std::uint32_t k = 0; k < solids_.size(); ++k) {
    const SpanSolid& solid = solids_[k];
    SolidPlace& place = places_.emplace_back();
    place.shape = solid.shape;
    place.surface = solid.surface;
    place.response = first + k;
    place.yields = solid.is_rigid;
    place.at = solid.at;
    place.velocity = place.ahead = solid.velocity;
    place.angular_velocity = place.ahead_turning = solid.angular_velocity;
    set_way(place, span_s);
  }
  std::size_t vertices = 0;
  for (const std::uint32_t i : soft) vertices += surfaces[i].from.size();
  const auto find = [&](const auto& is_full) {
    meetings_.clear();
    marks_.clear();
    marks_end_.clear();
    for (const std::uint32_t i : soft) {
      for (std::uint32_t k = 0; k < solids_.size() && !is_full(); ++k) {
        if (!meets(world, surfaces[i], i, k)) continue;
        const std::size_t before = rows.size();
        finder_.find(skin_move_of(surfaces[i], surfaces[i].from), i, places_[k], span_s, reach_share, rows);
        if (rows.size() > before) note_meeting(i, k, before, rows);
      }
    }
  };
  leave_out_crowds(world.soft, skin_rows_max(vertices), rows, find,
                   [](const ContactRow& row, Takings& rows_of) { rows_of.add(row.first.body, 1); });
}

template <class Real>
bool SpanSolids<Real>::meets(const ContactWorld<Real>& world, const SurfaceBody& surface, std::uint32_t soft,
                             std::uint32_t index) const {
  const SpanSolid& solid = solids_[index];
  if (world.soft[soft].is_crowded || (solid.is_rigid && !is_active(world.rigid[solid.index]))) return false;
  const bool is_awake = world.soft[soft].is_awake() || (solid.is_rigid && world.rigid[solid.index].is_awake());
  return is_awake && may_meet(surface, surface.way, places_[index]);
}

template <class Real>
void SpanSolids<Real>::note_meeting(std::uint32_t soft, std::uint32_t solid, std::size_t first_row,
                                    std::span<const ContactRow> rows) {
  meetings_.push_back({soft, solid, first_row, rows.size() - first_row, reach_share * finder_.furthest_m()});
  const bool is_flat = !has_features(*solids_[solid].shape);
  for (const ContactRow& row : rows.subspan(first_row)) {
    if (row.first.count > 1) continue;
    const unsigned walls = is_flat ? 1U << (row.key.features & 0xffU) : all_walls;
    marks_.push_back({row.first.vertices[0], static_cast<std::uint8_t>(walls)});
  }
  marks_end_.push_back(marks_.size());
}

template <class Real>
bool SpanSolids<Real>::stop_missed(const ContactWorld<Real>& world, std::span<const SurfaceBody> surfaces,
                                   std::span<const std::uint32_t> soft) {
  for (std::uint32_t k = 0; k < solids_.size(); ++k) {
    SpanSolid& solid = solids_[k];
    solid.move(world.rigid, world.colliders, world.substep.dt_s);
    places_[k].at = solid.start;
    places_[k].ahead = solid.end.origin - solid.start.origin;
    set_way(places_[k], 1.0);
  }
  bool any = false;
  std::size_t m = 0;
  for (const std::uint32_t i : soft) {
    if (!world.soft[i].is_awake()) continue;
    const Box way = surfaces[i].box_of_moves();
    for (std::uint32_t k = 0; k < solids_.size(); ++k) {
      const SpanSolid& solid = solids_[k];
      if (is_surface(*solid.shape) || (solid.is_rigid && !is_active(world.rigid[solid.index]))) continue;
      if (!may_meet(surfaces[i], way, places_[k])) continue;
      const double offset_m = surfaces[i].surface.thickness_m + solid.surface->thickness_m;
      if (!has_features(*solid.shape) && is_clear_of_walls(*solid.shape, solid.end, way, offset_m)) continue;
      marked_.assign(surfaces[i].to.size(), 0);
      while (m < meetings_.size() && std::pair(meetings_[m].soft, meetings_[m].solid) < std::pair(i, k)) ++m;
      if (m < meetings_.size() && meetings_[m].soft == i && meetings_[m].solid == k) {
        for (std::size_t r = m == 0 ? 0 : marks_end_[m - 1]; r < marks_end_[m]; ++r) {
          marked_[marks_[r].vertex] |= marks_[r].walls;
        }
      }
      any = stop_missed(world.soft[i], surfaces[i], solid) || any;
    }
  }
  return any;
}

template <class Real>
bool SpanSolids<Real>::stop_missed(SoftState<Real>& state, const SurfaceBody& surface, const SpanSolid& solid) const {
  const double offset_m = surface.surface.thickness_m + solid.surface->thickness_m;
  const Vec3d outer = half_extents_m(*solid.shape).array() + offset_m;
  const bool is_flat = !has_features(*solid.shape);
  bool any = false;
  for (std::uint32_t v = 0; v < surface.to.size(); ++v) {
    if (marked_[v] == all_walls || surface.inverse_masses_1_kg[v] == 0.0) continue;
    const Vec3d end = solid.end.to_local(surface.to[v]);
    if (is_flat && (walls_behind(*solid.shape, end, offset_m) & ~marked_[v]) == 0) continue;
    const Vec3d start = solid.start.to_local(surface.from[v]);
    const bool keeps_off =
        (start.cwiseMin(end).array() > outer.array()).any() || (start.cwiseMax(end).array() < -outer.array()).any();
    if (!is_flat && keeps_off) continue;
    const auto hit = first_hit(*solid.shape, start, end, offset_m, on_surface_share * surface.spacing_m);
    if (!hit) continue;
    state.dr[v] = (solid.end.to_world(hit->point) - state.position_m(v)).template cast<Real>();
    any = true;
  }
  return any;
}

template <class Real>
void SpanSolids<Real>::clear() {
  solids_.clear();
  is_still_.clear();
  places_.clear();
  meetings_.clear();
  marks_.clear();
  marks_end_.clear();
}

template <class Real>
std::size_t SpanSolids<Real>::bytes() const {
  return solids_.capacity() * sizeof(SpanSolid) + places_.capacity() * sizeof(SolidPlace) +
         meetings_.capacity() * sizeof(Meeting) + marks_.capacity() * sizeof(Mark) +
         marks_end_.capacity() * sizeof(std::size_t) + is_still_.capacity() + marked_.capacity() + finder_.bytes();
}

template class SpanSolids<float>;
template class SpanSolids<double>;

}  // namespace pneuma::physics
