#include "physics/contact/coupled_rows.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "physics/contact/crowding.h"
#include "physics/rigid/rigid_motion.h"

namespace pneuma::physics {
namespace {

// Of what two surfaces are nearer than they keep: what a pass parts them by. At once, the springs would be fed.
constexpr double parted_share = 0.2;
// A body that was put across a mesh is out of it within this time: what it then keeps is its speed on the way.
constexpr double way_out_time_s = 0.3;
// Of a group of rigid bodies: with more, a load's rows would be too many to be solved together (solver.h).
constexpr std::size_t rigid_rows_max = 64;

template <class Real>
EndPlace place_of(const CoupledWorld<Real>& world, const CoupledPasses& passes, const JointState& joint,
                  std::size_t which) {
  const JointEnd& end = joint.ends[which];
  const auto fixed = static_cast<std::uint32_t>(passes.bodies.size() + passes.solids.size());
  EndPlace place;
  if (end.of == Anchor::Of::soft) {
    const SoftState<Real>& state = world.soft[end.index];
    place.support = end.support;
    place.support.body = end.index;
    place.yields = state.is_awake() && world.bounds[end.index].active;
    if (place.yields) {
      const SurfaceBody& surface = passes.surface(end.index);
      place.at = mean_of(end.support, surface.from);
      place.ahead_m = mean_of(end.support, surface.to) - place.at;
    } else {
      for (std::uint32_t i = 0; i < end.support.count; ++i) {
        place.at += end.support.weights[i] * state.position_m(end.support.vertices[i]);
      }
      place.support.count = 0;
      place.support.body = fixed;
    }
  } else if (end.of == Anchor::Of::world) {
    place.at = joint.points_m[which];
    place.support.body = fixed;
  } else {
    const bool is_rigid = end.of == Anchor::Of::rigid;
    const bool yields = is_rigid && world.rigid[end.index].is_awake() && is_active(world.rigid[end.index]);
    const SolidPlace& solid = passes.solids[is_rigid ? end.index : world.rigid.size() + end.index];
    const bool moves = yields || !is_rigid;
    const Vec3d still = Vec3d::Zero();
    place = place_of_solid(joint, which, solid.at.origin, Quatd(solid.at.rotation), moves ? solid.ahead : still,
                           moves ? solid.ahead_turning : still, world.substep.dt_s);
    place.yields = yields;
    place.support.body = yields ? solid.response : fixed;
  }
  place.kept_m = kept_of_end<Real>(joint, which, world.soft, world.rigid, world.colliders);
  return place;
}

template <class Real>
void find_joint_rows(const CoupledWorld<Real>& world, CoupledPasses& passes) {
  const bool begins = passes.joints_left_m.empty();
  passes.joints_left_m.resize(world.joints.size());
  const JointStep step{world.substep.dt_s, world.substep.repairs};
  for (std::uint32_t i = 0; i < world.joints.size(); ++i) {
    const JointState& joint = world.joints[i];
    if (!joint.has_soft) continue;
    const EndPlace first = place_of(world, passes, joint, 0);
    const EndPlace second = place_of(world, passes, joint, 1);
    if (begins) passes.joints_left_m[i] = error_left_m(joint, first, second, step);
    append_joint_rows(joint, i, first, second, passes.joints_left_m[i], step, passes.rows);
  }
}

// A row of a mesh collider is one of a solid.
void aim_mesh_row(const CoupledPasses& passes, const SolidPlace& solid, double dt_s, ContactRow& row) {
  if (row.first.body >= passes.bodies.size()) {
    std::swap(row.first, row.second);
    row.normal = -row.normal;
  }
  const SurfaceBody& soft = passes.surface(row.first.body);
  const Vec3d arm = mean_of(row.second, passes.surface(row.second.body).from) - solid.at.origin;
  row.second = {.body = solid.response, .arm = arm};
  const Vec3d end = mean_of(row.first, soft.to);
  const Vec3d ahead_m = end - mean_of(row.first, soft.from) - dt_s * velocity_at(solid.ahead, solid.ahead_turning, arm);
  const Vec3d way_m = end - mean_of(row.first, passes.bodies[row.first.body].start) -
                      dt_s * velocity_at(solid.velocity, solid.angular_velocity, arm);
  aim_solid_row(row, ahead_m, way_m, dt_s);
  if (!is_way_out(row)) return;
  // Of the whole substep, or each pass would push it on.
  const double gap_m = row.gap_m - (way_m - ahead_m).dot(row.normal);
  row.free_m_s = way_m / dt_s;
  row.least_m_s = -gap_m * (gap_m > 0.0 ? 1.0 : std::min(1.0, dt_s / way_out_time_s)) / dt_s;
}

// The way of a substep so far counts for friction; what is ahead of the pass, for the gap.
template <class Real>
void aim_surface_rows(const CoupledWorld<Real>& world, std::span<const MeshCollider> meshes, CoupledPasses& passes) {
  const double dt_s = world.substep.dt_s;
  for (ContactRow& row : passes.rows) {
    const std::size_t last = std::max(row.first.body, row.second.body);
    if (last >= passes.bodies.size()) {
      aim_mesh_row(passes, passes.solids[world.rigid.size() + meshes[last - passes.bodies.size()].index], dt_s, row);
      continue;
    }
    const CoupledBody& a = passes.bodies[row.first.body];
    const CoupledBody& b = passes.bodies[row.second.body];
    const SurfaceBody& at_a = passes.surface(row.first.body);
    const SurfaceBody& at_b = passes.surface(row.second.body);
    const Vec3d end = mean_of(row.first, at_a.to) - mean_of(row.second, at_b.to);
    const Vec3d ahead = end - (mean_of(row.first, at_a.from) - mean_of(row.second, at_b.from));
    const Vec3d way = end - (mean_of(row.first, a.start) - mean_of(row.second, b.start));
    const Vec3d across = way - way.dot(row.normal) * row.normal;
    row.free_m_s = (ahead.dot(row.normal) * row.normal + across) / dt_s;
    row.least_m_s = (row.gap_m > 0.0 ? -row.gap_m : -parted_share * row.gap_m) / dt_s;
  }
}

template <class Real>
void find_solid_rows(const CoupledWorld<Real>& world, std::span<const SurfaceBody> surfaces, CoupledPasses& passes) {
  std::size_t vertices = 0;
  for (std::size_t i = 0; i < passes.bodies.size(); ++i) vertices += surfaces[i].from.size();
  const auto find = [&](const auto& is_full) {
    for (std::uint32_t i = 0; i < passes.bodies.size(); ++i) {
      if (!world.bounds[i].active || world.soft[i].is_crowded) continue;
      const SurfaceBody& body = surfaces[i];
      const Box way = body.box_of_moves();
      for (std::size_t k = 0; k < passes.solids.size() && !is_full(); ++k) {
        const bool is_rigid = k < world.rigid.size();
        if (is_rigid ? !is_active(world.rigid[k]) : !world.soft[i].is_awake()) continue;
        if (is_rigid && !world.soft[i].is_awake() && !world.rigid[k].is_awake()) continue;
        if (!may_meet(body, way, passes.solids[k])) continue;
        passes.solid_rows.find(skin_move_of(body, passes.bodies[i].start), i, passes.solids[k], world.substep.dt_s, 0.0,
                               passes.rows);
      }
    }
  };
  leave_out_crowds(world.soft, skin_rows_max(vertices), passes.rows, find,
                   [](const ContactRow& row, Takings& rows_of) { rows_of.add(row.first.body, 1); });
}

// What was put across a mesh still leaves it.
void part_none(std::span<ContactRow> rows) {
  for (ContactRow& row : rows) {
    if (!is_way_out(row)) row.least_m_s = std::min(row.least_m_s, 0.0);
  }
}

// Rows of bodies that leave a solid as wholes part by no more than these do in the substep.
template <class Real>
void carry_out(const CoupledWorld<Real>& world, CoupledPasses& passes) {
  const double dt_s = world.substep.dt_s;
  const std::size_t soft_count = passes.bodies.size();
  for (ContactRow& row : passes.rows) {
    if (row.gap_m > 0.0 || row.first.body >= soft_count || row.second.body < soft_count) continue;
    const Vec3d soft_m_s = world.carried(row.first.body);
    if (soft_m_s.isZero(0.0) || is_way_out(row)) continue;
    const SolidPlace& solid = passes.solids[row.second.body - soft_count];
    const Vec3d gone_m = mean_of(row.first, passes.surface(row.first.body).from) -
                         mean_of(row.first, passes.bodies[row.first.body].start) -
                         dt_s * (velocity_at(solid.velocity, solid.angular_velocity, row.second.arm) -
                                 velocity_at(solid.ahead, solid.ahead_turning, row.second.arm));
    const Vec3d left_m = dt_s * (soft_m_s - world.carried(row.second.body)) - gone_m;
    row.least_m_s = std::max(0.0, row.normal.dot(left_m)) / dt_s;
  }
}

// Adds the rows of each group of rigid bodies that a row of soft bodies or a joint touches.
template <class Real>
void add_rigid_rows(const CoupledWorld<Real>& world, CoupledPasses& passes) {
  if (world.rigid_rows.empty()) return;
  const std::size_t first = passes.bodies.size();
  const auto rigid_of = [&](const Support& side) -> std::optional<std::size_t> {
    if (side.body < first || side.body >= first + world.rigid.size()) return std::nullopt;
    return side.body - first;
  };
  std::vector<std::uint8_t> is_touched(world.rigid.size(), 0);  // of a group, at its first body
  for (const ContactRow& row : passes.rows) {
    for (const Support* side : {&row.first, &row.second}) {
      if (const auto rigid = rigid_of(*side)) is_touched[world.rigid_groups[*rigid]] = 1;
    }
  }
  std::vector<std::size_t> counts(world.rigid.size(), 0);
  for (const ContactRow& row : world.rigid_rows) ++counts[world.rigid_groups[*rigid_of(row.first)]];
  for (const ContactRow& row : world.rigid_rows) {
    const std::uint32_t group = world.rigid_groups[*rigid_of(row.first)];
    if (is_touched[group] == 0 || counts[group] > rigid_rows_max) continue;
    passes.rows.push_back(row);
    for (const Support* side : {&row.first, &row.second}) {
      if (const auto rigid = rigid_of(*side)) world.rigid_solved[*rigid] = 1;
    }
  }
}

}  // namespace

template <class Real>
void find_coupled_rows(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces, CoupledPasses& passes) {
  passes.rows.clear();
  surfaces.find_rows(world.soft, passes.rows);
  surfaces.add_ways_out(passes.rows);
  aim_surface_rows(world, surfaces.meshes(), passes);
  for (SolidPlace& solid : passes.solids) set_way(solid, world.substep.dt_s);
  find_solid_rows(world, surfaces.bodies(), passes);
  if (!world.substep.repairs) part_none(passes.rows);
  if (!world.carried_m_s.empty()) carry_out(world, passes);
  find_joint_rows(world, passes);
  add_rigid_rows(world, passes);
}

template void find_coupled_rows(const CoupledWorld<float>&, SurfaceContacts<float>&, CoupledPasses&);
template void find_coupled_rows(const CoupledWorld<double>&, SurfaceContacts<double>&, CoupledPasses&);

}  // namespace pneuma::physics
