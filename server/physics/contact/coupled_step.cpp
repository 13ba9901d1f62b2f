#include "physics/contact/coupled_step.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/contact/filter.h"
#include "physics/contact/surface_rows.h"
#include "physics/forces/gas.h"
#include "physics/forces/measures.h"
#include "physics/implicit/implicit_euler.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/rigid/rigid_motion.h"

namespace pneuma::physics {
namespace {

constexpr int coupled_passes_max = 4;
constexpr std::uint32_t coupled_sweeps_max = 30;
// Of these many rows, a dense program of three times as many unknowns takes a few milliseconds.
constexpr std::size_t direct_rows_max = 160;
// Of the mean edge a substep: what rows may be off by.
constexpr double coupled_enough_share = 1e-6;
// The same of joints whose soft bodies are all frozen.
constexpr double joints_alone_enough_m_s = 1e-9;
// Of what two surfaces are nearer than they keep: what a pass parts them by. At once, the springs would be fed.
constexpr double parted_share = 0.2;
// A body on a line does not turn as a whole.
constexpr double whole_turning_share_min = 1e-9;
// The rebound is of few bodies as wholes; off by this share of what counts as resting.
constexpr std::uint32_t rebound_sweeps_max = 50;
constexpr double rebound_enough_share = 1e-6;
// A body that was put across a mesh is out of it within this time: what it then keeps is its speed on the way.
constexpr double way_out_time_s = 0.3;
// What a pass may move vertices by and be the last.
constexpr double pass_settled_share = 1e-4;
// Of the internal forces' moments: the stress stiffness of a body's rotations, as a bound from above.
constexpr double stress_share = 2.0;
// Of the approach that would have taken a body in: less than this left over is none.
constexpr double stopped_share = 0.1;
// The edges' share of a pressure, as a stiffness that the springs do not have.
constexpr double pressure_share = 0.5;

template <class Real>
bool is_held(const SoftState<Real>& body, const Atmosphere& atmosphere) {
  return !body.pinned.empty() || !body.grabs.empty() || has_wind(body.body, atmosphere);
}

Vec3d weighted_sum(std::span<const double> masses_kg, std::span<const Vec3d> values) {
  Vec3d sum = Vec3d::Zero();
  for (std::size_t i = 0; i < values.size(); ++i) sum += masses_kg[i] * values[i];
  return sum;
}

double total(std::span<const double> values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum;
}

Vec3d mean_of(const Support& at, std::span<const Vec3d> values) {
  Vec3d sum = Vec3d::Zero();
  for (std::uint32_t i = 0; i < at.count; ++i) sum += at.weights[i] * values[at.vertices[i]];
  return sum;
}

}  // namespace

template <class Real>
void CoupledStep<Real>::load(const CoupledWorld<Real>& world) {
  bodies_.resize(world.soft.size());
  for (std::size_t i = 0; i < world.soft.size(); ++i) {
    const SoftState<Real>& state = world.soft[i];
    Body& body = bodies_[i];
    body.in_contact = false;
    if (!world.bounds[i].active) continue;
    const std::size_t count = state.x.size();
    body.is_free = !is_held(state, world.surroundings.atmosphere);
    for (std::vector<Vec3d>* points : {&body.start, &body.x0, &body.u0, &body.u}) points->resize(count);
    const bool awake = state.is_awake();
    for (std::size_t k = 0; k < count; ++k) {
      body.x0[k] = state.x[k].template cast<double>();
      body.start[k] = state.origin_m + body.x0[k];
      body.u0[k] = awake ? Vec3d(world.start_m_s[i][k].template cast<double>()) : Vec3d(Vec3d::Zero());
      body.u[k] = awake ? Vec3d(state.dr[k].template cast<double>() / world.dt_s) : Vec3d(Vec3d::Zero());
    }
  }
  solids_.clear();
  const auto first = static_cast<std::uint32_t>(world.soft.size());
  for (const RigidState& rigid : world.rigid) {
    SolidPlace& solid = solids_.emplace_back();
    solid.shape = &rigid.body.shape;
    solid.surface = &rigid.body.surface;
    solid.at = {rigid.position, rigid.orientation};
    solid.velocity = solid.ahead = rigid.velocity;
    solid.angular_velocity = solid.ahead_turning = rigid.angular_velocity;
  }
  for (const ColliderState& collider : world.colliders) {
    SolidPlace& solid = solids_.emplace_back();
    solid.shape = &collider.collider.shape;
    solid.surface = &collider.collider.surface;
    solid.at = {collider.position, collider.orientation};
    solid.velocity = solid.ahead = collider.collider.velocity;
    solid.angular_velocity = solid.ahead_turning = collider.collider.angular_velocity;
  }
  for (std::size_t i = 0; i < solids_.size(); ++i) solids_[i].response = first + static_cast<std::uint32_t>(i);
  rigid_velocities_m_s_.assign(world.rigid.size(), Vec3d::Zero());
  rigid_turnings_rad_s_.assign(world.rigid.size(), Vec3d::Zero());
  yields_.assign(first + solids_.size() + 1, 1);
  for (std::size_t i = first + world.rigid.size(); i < yields_.size(); ++i) yields_[i] = 0;
}

template <class Real>
void CoupledStep<Real>::find_rows(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces) {
  rows_.clear();
  surfaces.find_rows(rows_);
  surfaces.add_ways_out(rows_);
  aim_surface_rows(world, surfaces.meshes());
  for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
    if (!world.bounds[i].active) continue;
    const SurfaceBody& body = surfaces.bodies()[i];
    for (std::size_t k = 0; k < solids_.size(); ++k) {
      const bool is_rigid = k < world.rigid.size();
      if (is_rigid ? !is_active(world.rigid[k]) : !world.soft[i].is_awake()) continue;
      if (is_rigid && !world.soft[i].is_awake() && !world.rigid[k].is_awake()) continue;
      find_solid_rows(body, i, bodies_[i].start, solids_[k], world.dt_s, rows_);
      if (is_rigid) find_corner_rows(body, i, bodies_[i].start, solids_[k], world.dt_s, rows_);
    }
  }
  find_joint_rows(world);
}

template <class Real>
EndPlace CoupledStep<Real>::place_of(const CoupledWorld<Real>& world, const JointState& joint,
                                     std::size_t which) const {
  const JointEnd& end = joint.ends[which];
  const auto fixed = static_cast<std::uint32_t>(bodies_.size() + solids_.size());
  EndPlace place;
  if (end.of == Anchor::Of::soft) {
    const SoftState<Real>& state = world.soft[end.index];
    place.support = end.support;
    place.support.body = end.index;
    place.yields = state.is_awake() && world.bounds[end.index].active;
    if (place.yields) {
      const SurfaceBody& surface = (*surfaces_)[end.index];
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
    const SolidPlace& solid = solids_[is_rigid ? end.index : world.rigid.size() + end.index];
    const bool moves = yields || !is_rigid;
    const Vec3d still = Vec3d::Zero();
    place = place_of_solid(joint, which, solid.at.origin, Quatd(solid.at.rotation), moves ? solid.ahead : still,
                           moves ? solid.ahead_turning : still, world.dt_s);
    place.yields = yields;
    place.support.body = yields ? solid.response : fixed;
  }
  place.kept_m = kept_of_end<Real>(joint, which, world.soft, world.rigid, world.colliders);
  return place;
}

template <class Real>
void CoupledStep<Real>::find_joint_rows(const CoupledWorld<Real>& world) {
  const bool begins = joints_left_m_.empty();
  joints_left_m_.resize(world.joints.size());
  for (std::uint32_t i = 0; i < world.joints.size(); ++i) {
    const JointState& joint = world.joints[i];
    if (!joint.has_soft) continue;
    const EndPlace first = place_of(world, joint, 0);
    const EndPlace second = place_of(world, joint, 1);
    if (begins) joints_left_m_[i] = error_left_m(joint, first, second, world.dt_s);
    append_joint_rows(joint, i, first, second, joints_left_m_[i], world.dt_s, rows_);
  }
}

// The way of a substep so far counts for friction; what is ahead of the pass, for the gap.
template <class Real>
void CoupledStep<Real>::aim_surface_rows(const CoupledWorld<Real>& world, std::span<const MeshCollider> meshes) {
  const double dt_s = world.dt_s;
  for (ContactRow& row : rows_) {
    const std::size_t last = std::max(row.first.body, row.second.body);
    if (last >= bodies_.size()) {
      aim_mesh_row(row, solids_[world.rigid.size() + meshes[last - bodies_.size()].index], dt_s);
      continue;
    }
    const Body& a = bodies_[row.first.body];
    const Body& b = bodies_[row.second.body];
    const SurfaceBody& at_a = (*surfaces_)[row.first.body];
    const SurfaceBody& at_b = (*surfaces_)[row.second.body];
    const Vec3d end = mean_of(row.first, at_a.to) - mean_of(row.second, at_b.to);
    const Vec3d ahead = end - (mean_of(row.first, at_a.from) - mean_of(row.second, at_b.from));
    const Vec3d way = end - (mean_of(row.first, a.start) - mean_of(row.second, b.start));
    const Vec3d across = way - way.dot(row.normal) * row.normal;
    row.free_m_s = (ahead.dot(row.normal) * row.normal + across) / dt_s;
    row.least_m_s = (row.gap_m > 0.0 ? -row.gap_m : -parted_share * row.gap_m) / dt_s;
  }
}

// A row of a mesh collider is one of a solid.
template <class Real>
void CoupledStep<Real>::aim_mesh_row(ContactRow& row, const SolidPlace& solid, double dt_s) const {
  if (row.first.body >= bodies_.size()) {
    std::swap(row.first, row.second);
    row.normal = -row.normal;
  }
  const SurfaceBody& soft = (*surfaces_)[row.first.body];
  const Vec3d arm = mean_of(row.second, (*surfaces_)[row.second.body].from) - solid.at.origin;
  row.second = {.body = solid.response, .arm = arm};
  const Vec3d end = mean_of(row.first, soft.to);
  const Vec3d ahead_m = end - mean_of(row.first, soft.from) - dt_s * velocity_at(solid.ahead, solid.ahead_turning, arm);
  const Vec3d way_m = end - mean_of(row.first, bodies_[row.first.body].start) -
                      dt_s * velocity_at(solid.velocity, solid.angular_velocity, arm);
  aim_solid_row(row, ahead_m, way_m, dt_s);
  if (!is_way_out(row)) return;
  // Of the whole substep, or each pass would push it on.
  const double gap_m = row.gap_m - (way_m - ahead_m).dot(row.normal);
  row.free_m_s = way_m / dt_s;
  row.least_m_s = -gap_m * (gap_m > 0.0 ? 1.0 : std::min(1.0, dt_s / way_out_time_s)) / dt_s;
}

// Newton's step without contact, in the metric of the passes. False where it is not finite.
template <class Real>
bool CoupledStep<Real>::move_freely(const CoupledWorld<Real>& world, std::size_t index) {
  SoftState<Real>& state = world.soft[index];
  Body& body = bodies_[index];
  const double s = world.dt_s;
  const std::vector<double>& masses_kg = body.metric.matrix().diagonal;
  const std::size_t count = body.u.size();
  if (!state.is_awake()) {
    residual_.assign(count, Vec3d::Zero());
    body.metric.move_to({body.x0, {}, 0.0, 0.0}, residual_, body.step);
    return true;
  }
  x_.resize(count);
  for (std::size_t i = 0; i < count; ++i) x_[i] = body.x0[i] + s * body.u[i];
  const std::span<const Vec3d> f = solver_.force(state, world.tables[index], x_, body.u, world.surroundings, nullptr);
  residual_.resize(count);
  Vec3d sum = Vec3d::Zero();
  double stress_n_m = 0.0;
  const Vec3d centre = weighted_sum(masses_kg, x_) / total(masses_kg);
  for (std::size_t i = 0; i < count; ++i) {
    const double mass_kg = state.mass_kg(i);
    residual_[i] = mass_kg * (body.u0[i] - body.u[i]) + s * f[i];
    if (state.is_pinned(i)) residual_[i].setZero();
    sum += residual_[i];
    stress_n_m += (f[i] - mass_kg * world.surroundings.gravity).norm() * (x_[i] - centre).norm();
  }
  if (!sum.allFinite()) return false;
  const std::span<const Vec3d> gradient = solver_.volume_gradient_m2();
  const double gas = state.gas ? s * s * gas_stiffness_pa_m3(*state.gas, *state.body.gas, state.volume_m3) : 0.0;
  body.metric.move_to({x_, gradient, gas, stress_share * stress_n_m}, residual_, body.step);
  if (body.is_free) {
    const Vec3d missing = (sum - weighted_sum(masses_kg, body.step)) / total(masses_kg);
    for (Vec3d& step : body.step) step += missing;
  }
  for (std::size_t i = 0; i < count; ++i) body.u[i] += body.step[i];
  return true;
}

// The passes are implicit Euler's, so they start from its step.
template <class Real>
void CoupledStep<Real>::step_by_first_order(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    SoftState<Real>& state = world.soft[i];
    if (!body.in_contact || !state.is_awake()) continue;
    state.v = world.start_m_s[i];
    if (!euler_again(state, world.tables[i], *world.first_order, world.surroundings, world.dt_s, solver_)) {
      state.solve_failed = true;
      body.in_contact = false;
      continue;
    }
    for (std::size_t k = 0; k < body.u.size(); ++k) {
      body.u[k] = state.v[k].template cast<double>();
      surfaces.bodies()[i].to[k] = body.start[k] + world.dt_s * body.u[k];
    }
  }
}

template <class Real>
void CoupledStep<Real>::begin_metrics(const CoupledWorld<Real>& world) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    if (!body.in_contact) continue;
    const SoftState<Real>& state = world.soft[i];
    ImplicitTables<Real>& tables = world.tables[i];
    const double stress_n_m =
        state.gas ? pressure_share * std::max(0.0, state.pressure_pa) * (*surfaces_)[i].spacing_m : 0.0;
    tables.matrices->update(tables.held.touching, state, world.surroundings, world.dt_s, stress_n_m);
    if (!tables.held.touching) {
      body.in_contact = false;
      continue;
    }
    x_.resize(body.u.size());  // where it is about to be: rotations from where it was would shear it
    for (std::size_t k = 0; k < x_.size(); ++k) x_[k] = body.x0[k] + world.dt_s * body.u[k];
    body.metric.begin(*tables.held.touching, body.is_free, x_);
  }
}

template <class Real>
void CoupledStep<Real>::solve(const CoupledWorld<Real>& world) {
  const std::size_t soft_count = bodies_.size();
  responses_.clear();
  for (std::size_t i = 0; i < soft_count; ++i) {
    if (bodies_[i].in_contact) {
      responses_.emplace_back(FactoredResponse(bodies_[i].metric));
    } else {
      responses_.emplace_back(FixedResponse{});
    }
  }
  for (const RigidState& rigid : world.rigid) {
    responses_.emplace_back(RigidResponse(inverse_masses_1_kg(rigid), inverse_inertia_1_kg_m2(rigid)));
  }
  for (std::size_t i = 0; i <= world.colliders.size(); ++i) responses_.emplace_back(FixedResponse{});
  double spacing_m = 0.0;
  for (ContactRow& row : rows_) {
    for (Support* side : {&row.first, &row.second}) {
      if (auto* response = std::get_if<FactoredResponse>(&responses_[side->body])) {
        response->add(*side);
        spacing_m = std::max(spacing_m, (*surfaces_)[side->body].spacing_m);
      }
    }
    const auto before = std::ranges::lower_bound(warm_, row.key, {}, &ContactRow::key);
    if (before != warm_.end() && before->key == row.key && joint_of(row)) {
      row.impulse_n_s = before->impulse_n_s;
      if (row.kind == RowKind::guide) row.impulse_n_s -= row.impulse_n_s.dot(row.normal) * row.normal;
      if (row.kind == RowKind::contact) {
        row.impulse_n_s = std::max(0.0, row.impulse_n_s.dot(row.normal)) * row.normal;
      }
    } else if (before != warm_.end() && before->key == row.key) {
      const double pressed_n_s = std::max(0.0, before->impulse_n_s.dot(row.normal));
      const Vec3d rubbed_n_s = before->impulse_n_s - before->impulse_n_s.dot(row.normal) * row.normal;
      const double most_n_s = row.friction * pressed_n_s;
      const double rubbed = rubbed_n_s.norm();
      row.impulse_n_s = pressed_n_s * row.normal + (rubbed > most_n_s ? most_n_s / rubbed : 1.0) * rubbed_n_s;
    }
  }
  for (Response& response : responses_) {
    if (auto* factored = std::get_if<FactoredResponse>(&response)) factored->finish();
  }
  group_rows(rows_, yields_, groups_);
  const double enough_m_s = spacing_m > 0.0 ? coupled_enough_share * spacing_m / world.dt_s : joints_alone_enough_m_s;
  const SolveLimits limits{
      .sweeps_max = coupled_sweeps_max, .enough_m_s = enough_m_s, .direct_rows_max = direct_rows_max};
  for (const RowGroup& group : groups_) {
    const SolveOutcome outcome =
        solve_rows(std::span(rows_).subspan(group.begin, group.end - group.begin), responses_, limits);
    counts_.unconverged += outcome.converged ? 0 : 1;
  }
  warm_ = rows_;
  std::ranges::sort(warm_, {}, &ContactRow::key);
}

// Takes the impulses' answer, and goes as far towards it as nothing crosses. Returns how far a vertex is from where the
// pass began.
template <class Real>
double CoupledStep<Real>::end_pass(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces) {
  const double s = world.dt_s;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    if (!body.in_contact) continue;
    const std::vector<double>& masses_kg = body.metric.matrix().diagonal;
    auto& response = std::get<FactoredResponse>(responses_[i]);
    body.step.assign(body.u.size(), Vec3d::Zero());
    response.add_changes(body.step);
    if (body.is_free) {
      const Vec3d missing = (response.impulse_n_s() - weighted_sum(masses_kg, body.step)) / total(masses_kg);
      for (Vec3d& step : body.step) step += missing;
    }
    SurfaceBody& surface = surfaces.bodies()[i];
    for (std::size_t k = 0; k < body.u.size(); ++k) {
      body.u[k] += body.step[k];
      surface.to[k] = body.start[k] + s * body.u[k];
    }
  }
  for (std::size_t k = 0; k < world.rigid.size(); ++k) {
    const auto& response = std::get<RigidResponse>(responses_[bodies_.size() + k]);
    const Vec3d velocity = world.rigid[k].velocity + response.velocity_change_m_s();
    const Vec3d turning = world.rigid[k].angular_velocity + response.turning_change_rad_s();
    solids_[k].ahead = velocity - rigid_velocities_m_s_[k];
    solids_[k].ahead_turning = turning - rigid_turnings_rad_s_[k];
    rigid_velocities_m_s_[k] = velocity;
    rigid_turnings_rad_s_[k] = turning;
  }
  double furthest_m2 = 0.0;
  surfaces.update_candidates(world.soft);
  surfaces.carry(bodies_.size());
  cut_moves(surfaces.pairs(), surfaces.bodies());
  for (std::size_t i = bodies_.size(); i < surfaces.bodies().size(); ++i) {
    SurfaceBody& mesh = surfaces.bodies()[i];
    mesh.from = mesh.to;
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (!bodies_[i].in_contact) continue;
    SurfaceBody& surface = surfaces.bodies()[i];
    for (const SolidPlace& solid : solids_) cut_at_solid(surface, solid, s);
    for (std::size_t k = 0; k < surface.from.size(); ++k) {
      furthest_m2 = std::max(furthest_m2, surface.move_m(static_cast<std::uint32_t>(k)).squaredNorm());
      if (surface.cuts[k] < 1.0) {
        surface.from[k] += surface.cuts[k] * surface.move_m(static_cast<std::uint32_t>(k));
        ++counts_.cut_vertices;
        surface.cuts[k] = 1.0;
      } else {
        surface.from[k] = surface.to[k];
      }
    }
  }
  for (std::size_t k = 0; k < solids_.size(); ++k) {
    SolidPlace& solid = solids_[k];
    const Quatd orientation = turned(Quatd(solid.at.rotation), solid.ahead_turning, s);
    solid.at = {solid.at.origin + s * solid.ahead, orientation};
    const bool is_rigid = k < world.rigid.size();
    solid.ahead = is_rigid ? Vec3d(solid.velocity - rigid_velocities_m_s_[k]) : Vec3d(Vec3d::Zero());
    solid.ahead_turning = is_rigid ? Vec3d(solid.angular_velocity - rigid_turnings_rad_s_[k]) : Vec3d(Vec3d::Zero());
  }
  return std::sqrt(furthest_m2);
}

template <class Real>
void CoupledStep<Real>::run(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces) {
  surfaces.find_all(world.soft, world.bounds);
  surfaces_ = &surfaces.bodies();
  load(world);
  warm_.clear();
  joints_left_m_.clear();
  find_rows(world, surfaces);
  if (rows_.empty()) return;
  for (const ContactRow& row : rows_) {
    for (const Support* side : {&row.first, &row.second}) {
      if (side->body < bodies_.size()) bodies_[side->body].in_contact = true;
    }
  }
  if (world.first_order) step_by_first_order(world, surfaces);
  begin_metrics(world);
  double spacing_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i].in_contact) spacing_m = std::min(spacing_m, (*surfaces_)[i].spacing_m);
  }
  for (int pass = 0; pass < coupled_passes_max; ++pass) {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      Body& body = bodies_[i];
      if (!body.in_contact) continue;
      if (!move_freely(world, i)) {
        world.soft[i].solve_failed = true;
        body.in_contact = false;
        continue;
      }
      SurfaceBody& surface = surfaces.bodies()[i];
      for (std::size_t k = 0; k < body.u.size(); ++k) surface.to[k] = body.start[k] + world.dt_s * body.u[k];
    }
    find_rows(world, surfaces);
    std::erase_if(rows_, [&](const ContactRow& row) {
      const auto left_out = [&](const Support& side) {
        return side.body < bodies_.size() && !bodies_[side.body].in_contact;
      };
      return left_out(row.first) || left_out(row.second);
    });
    counts_.rows += rows_.size();
    solve(world);
    if (end_pass(world, surfaces) <= pass_settled_share * spacing_m) break;
  }
  rebound(world);
  for (const ContactRow& row : rows_) {
    if (joint_of(row) && has_given_way(row)) world.joints[*joint_of(row)].broken = true;
  }
  store(world);
  note(world);
}

namespace {

/// The motion of a body as a whole.
struct WholeMotion {
  double mass_kg = 0.0;
  Vec3d centre = Vec3d::Zero();
  Vec3d velocity = Vec3d::Zero();
  Vec3d turning = Vec3d::Zero();
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d inverse_inertia_1_kg_m2 = Eigen::Matrix3d::Zero();

  [[nodiscard]] Vec3d at(const Vec3d& place) const { return velocity + turning.cross(place - centre); }
};

WholeMotion whole_of(std::span<const double> masses_kg, std::span<const Vec3d> x, std::span<const Vec3d> u) {
  WholeMotion whole;
  whole.mass_kg = total(masses_kg);
  whole.centre = weighted_sum(masses_kg, x) / whole.mass_kg;
  whole.velocity = weighted_sum(masses_kg, u) / whole.mass_kg;
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  Vec3d spin = Vec3d::Zero();
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3d arm = x[i] - whole.centre;
    products += masses_kg[i] * arm * arm.transpose();
    spin += masses_kg[i] * arm.cross(u[i]);
  }
  const Eigen::Matrix3d inertia = products.trace() * Eigen::Matrix3d::Identity() - products;
  const double size = inertia.trace();
  if (!(inertia.determinant() > whole_turning_share_min * size * size * size)) return whole;
  whole.inertia_kg_m2 = inertia;
  whole.inverse_inertia_1_kg_m2 = inertia.inverse();
  whole.turning = whole.inverse_inertia_1_kg_m2 * spin;
  return whole;
}

}  // namespace

// What a body has less of after the passes than it had before the substep.
template <class Real>
double CoupledStep<Real>::taken_energy_j(const CoupledWorld<Real>& world, std::size_t index) {
  const SoftState<Real>& state = world.soft[index];
  const Body& body = bodies_[index];
  const std::vector<double>& masses_kg = body.metric.matrix().diagonal;
  const auto energy_j = [&](std::span<const Vec3d> x, std::span<const Vec3d> u) {
    double sum = potential_j(state, x, world.surroundings.atmosphere.pressure_pa, world.surroundings.gravity);
    for (std::size_t i = 0; i < u.size(); ++i) sum += 0.5 * masses_kg[i] * u[i].squaredNorm();
    return sum;
  };
  return energy_j(body.start, body.u0) - energy_j((*surfaces_)[index].from, body.u);
}

// Of a collider, where the row touches it; what gives way drives nothing.
template <class Real>
Vec3d CoupledStep<Real>::surface_velocity_of(const CoupledWorld<Real>& world, const ContactRow& row) const {
  const std::size_t first = bodies_.size() + world.rigid.size();
  if (row.second.body < first || row.second.body == bodies_.size() + solids_.size()) return Vec3d::Zero();
  const SolidPlace& solid = solids_[row.second.body - bodies_.size()];
  return velocity_at(solid.velocity, solid.angular_velocity, row.second.arm);
}

// What a body as a whole came with, and was stopped of within this substep, goes back by its restitution. Where springs
// take longer to stop it, they give it back themselves, as do those of a body that is held elsewhere.
template <class Real>
void CoupledStep<Real>::rebound(const CoupledWorld<Real>& world) {
  std::vector<ContactRow> rows;
  for (const ContactRow& row : rows_) {
    const auto gives_way = [&](const Support& side) {
      if (side.body < bodies_.size()) return bodies_[side.body].is_free && world.soft[side.body].tie == 0;
      return side.body >= bodies_.size() + world.rigid.size() || world.rigid[side.body - bodies_.size()].tie == 0;
    };
    const bool bounces = row.restitution > 0.0 && gives_way(row.first) && gives_way(row.second);
    if (bounces && row.impulse_n_s.dot(row.normal) > 0.0) rows.push_back(row);
  }
  if (rows.empty()) return;
  std::vector<WholeMotion> before(bodies_.size());
  std::vector<WholeMotion> after(bodies_.size());
  std::vector<Response> responses;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    if (!body.in_contact) {
      responses.emplace_back(FixedResponse{});
      continue;
    }
    const std::vector<double>& masses_kg = body.metric.matrix().diagonal;
    before[i] = whole_of(masses_kg, body.start, body.u0);
    after[i] = whole_of(masses_kg, body.start, body.u);
    if (body.is_free) {
      responses.emplace_back(RigidResponse(1.0 / after[i].mass_kg, after[i].inverse_inertia_1_kg_m2));
    } else {
      responses.emplace_back(FixedResponse{});
    }
  }
  for (std::size_t k = 0; k < solids_.size(); ++k) {
    if (k < world.rigid.size()) {
      const RigidState& rigid = world.rigid[k];
      responses.emplace_back(RigidResponse(inverse_masses_1_kg(rigid), inverse_inertia_1_kg_m2(rigid)));
    } else {
      responses.emplace_back(FixedResponse{});
    }
  }
  const double dt_s = world.dt_s;
  std::erase_if(rows, [&](ContactRow& row) {
    const Vec3d place = mean_of(row.first, bodies_[row.first.body].start);
    Vec3d came = before[row.first.body].at(place);
    Vec3d goes = after[row.first.body].at(place);
    Vec3d pull = world.soft[row.first.body].is_awake() ? world.surroundings.gravity : Vec3d(Vec3d::Zero());
    Vec3d way = mean_of(row.first, (*surfaces_)[row.first.body].to) - place;
    row.first.arm = place - after[row.first.body].centre;
    if (row.second.body < bodies_.size()) {
      const Vec3d other = mean_of(row.second, bodies_[row.second.body].start);
      came -= before[row.second.body].at(other);
      goes -= after[row.second.body].at(other);
      row.second.arm = other - after[row.second.body].centre;
      way -= mean_of(row.second, (*surfaces_)[row.second.body].to) - other;
      if (world.soft[row.second.body].is_awake()) pull -= world.surroundings.gravity;
    } else {
      const std::size_t k = row.second.body - bodies_.size();
      const bool is_rigid = k < world.rigid.size();
      const Vec3d origin = is_rigid ? world.rigid[k].position : world.colliders[k - world.rigid.size()].position;
      row.second.arm = place - origin;
      const Vec3d gravity = is_rigid && world.rigid[k].is_awake()
                                ? pull_m_s2(world.rigid[k], world.surroundings.gravity)
                                : Vec3d(Vec3d::Zero());
      came -= velocity_at(solids_[k].velocity - dt_s * gravity, solids_[k].angular_velocity, row.second.arm);
      const Vec3d surface_velocity =
          is_rigid ? velocity_at(rigid_velocities_m_s_[k], rigid_turnings_rad_s_[k], row.second.arm)
                   : velocity_at(solids_[k].velocity, solids_[k].angular_velocity, row.second.arm);
      way -= dt_s * surface_velocity;
      pull -= gravity;
      goes -= surface_velocity;
    }
    // Both end the substep on each other; so the gap at its start is the way that they came.
    const double gap_m = std::max(0.0, -way.dot(row.normal));
    const double pull_m_s2 = std::max(0.0, -pull.dot(row.normal));
    const double came_m_s = came.dot(row.normal);
    const double hit_m_s = -std::sqrt(came_m_s * came_m_s + 2.0 * pull_m_s2 * gap_m);
    const double goes_m_s = goes.dot(row.normal);
    const double past_m_s = hit_m_s + gap_m / dt_s;  // the speed that would have taken it in
    const bool was_stopped = came_m_s < -world.resting_m_s && goes_m_s + gap_m / dt_s > stopped_share * past_m_s;
    row.free_m_s = goes_m_s * row.normal;
    row.least_m_s = -row.restitution * hit_m_s;
    row.impulse_n_s.setZero();
    row.friction = 0.0;
    return !was_stopped;
  });
  if (rows.empty()) return;
  (void)solve_rows(rows, responses,
                   {.sweeps_max = rebound_sweeps_max, .enough_m_s = rebound_enough_share * world.resting_m_s});
  // The rebound gives back no more than contact took: a body that also stays squeezed keeps that much of it.
  double taken_j = 0.0;
  double linear_j = 0.0;
  double square_j = 0.0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const auto* whole = std::get_if<RigidResponse>(&responses[i]);
    if (whole == nullptr) continue;
    taken_j += taken_energy_j(world, i);
    const double mass_kg = after[i].mass_kg;
    const Vec3d change = whole->velocity_change_m_s();
    const Vec3d turn = whole->turning_change_rad_s();
    linear_j += mass_kg * change.dot(after[i].velocity) + turn.dot(after[i].inertia_kg_m2 * after[i].turning);
    square_j += 0.5 * (mass_kg * change.squaredNorm() + turn.dot(after[i].inertia_kg_m2 * turn));
  }
  for (std::size_t k = 0; k < world.rigid.size(); ++k) {
    const RigidState& rigid = world.rigid[k];
    const auto& whole = std::get<RigidResponse>(responses[bodies_.size() + k]);
    const Eigen::Matrix3d rotation = rigid.orientation.toRotationMatrix();
    const Eigen::Matrix3d inertia =
        rotation * rigid.inverse_inertia_1_kg_m2.cwiseInverse().asDiagonal() * rotation.transpose();
    const auto kinetic_j = [&](const Vec3d& velocity, const Vec3d& turning) {
      return 0.5 * rigid.body.mass_kg * velocity.squaredNorm() + 0.5 * turning.dot(inertia * turning);
    };
    const Vec3d change = whole.velocity_change_m_s();
    const Vec3d turn = whole.turning_change_rad_s();
    taken_j += kinetic_j(rigid.velocity, rigid.angular_velocity) -
               kinetic_j(rigid_velocities_m_s_[k], rigid_turnings_rad_s_[k]);
    linear_j +=
        rigid.body.mass_kg * change.dot(rigid_velocities_m_s_[k]) + turn.dot(inertia * rigid_turnings_rad_s_[k]);
    square_j += kinetic_j(change, turn);
  }
  for (const ContactRow& row : rows_) taken_j += row.impulse_n_s.dot(surface_velocity_of(world, row));
  double driven_j = 0.0;  // by the surfaces that the rebound pushes off
  for (const ContactRow& row : rows) driven_j += row.impulse_n_s.dot(surface_velocity_of(world, row));
  linear_j -= driven_j;
  const double allowed_j = std::max(0.0, taken_j);
  double share = 1.0;
  if (square_j > 0.0 && linear_j + square_j > allowed_j) {
    share = (-linear_j + std::sqrt(linear_j * linear_j + 4.0 * square_j * allowed_j)) / (2.0 * square_j);
    share = std::clamp(share, 0.0, 1.0);
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const auto* whole = std::get_if<RigidResponse>(&responses[i]);
    if (whole == nullptr) continue;
    Body& body = bodies_[i];
    for (std::size_t k = 0; k < body.u.size(); ++k) {
      body.u[k] += share * velocity_at(whole->velocity_change_m_s(), whole->turning_change_rad_s(),
                                       body.start[k] - after[i].centre);
    }
  }
  for (std::size_t k = 0; k < world.rigid.size(); ++k) {
    const auto& whole = std::get<RigidResponse>(responses[bodies_.size() + k]);
    rigid_velocities_m_s_[k] += share * whole.velocity_change_m_s();
    rigid_turnings_rad_s_[k] += share * whole.turning_change_rad_s();
  }
}

template <class Real>
void CoupledStep<Real>::store(const CoupledWorld<Real>& world) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    if (!body.in_contact) continue;
    SoftState<Real>& state = world.soft[i];
    const SurfaceBody& surface = (*surfaces_)[i];
    state.dr.resize(state.x.size());
    for (std::size_t k = 0; k < body.u.size(); ++k) {
      const Vec3d move = surface.from[k] - body.start[k];
      state.dr[k] = state.is_pinned(k) ? Vec3<Real>(Vec3<Real>::Zero()) : Vec3<Real>(move.template cast<Real>());
      state.v[k] = body.u[k].template cast<Real>();
    }
  }
  for (std::size_t k = 0; k < world.rigid.size(); ++k) {
    world.rigid[k].velocity = rigid_velocities_m_s_[k];
    world.rigid[k].angular_velocity = rigid_turnings_rad_s_[k];
  }
}

template <class Real>
void CoupledStep<Real>::note(const CoupledWorld<Real>& world) const {
  using Other = VertexContact::Other;
  const std::size_t soft_count = bodies_.size();
  for (const ContactRow& row : rows_) {
    if (joint_of(row) || !(row.impulse_n_s.dot(row.normal) > 0.0)) continue;
    world.soft_touched[row.first.body] = 1;
    const std::size_t second = row.second.body;
    const bool is_rigid = second >= soft_count && second < soft_count + world.rigid.size();
    if (second < soft_count) world.soft_touched[second] = 1;
    if (is_rigid) world.rigid_touched[second - soft_count] = 1;
    if (world.notes.empty()) continue;
    const Other other = second < soft_count ? Other::soft : is_rigid ? Other::rigid : Other::collider;
    const std::size_t before = second < soft_count ? 0 : is_rigid ? soft_count : soft_count + world.rigid.size();
    const auto append = [&](const Support& of, Other kind, std::size_t index, const Vec3d& normal) {
      for (std::uint32_t i = 0; i < of.count; ++i) {
        world.notes[of.body].push_back({of.vertices[i], kind, static_cast<std::uint32_t>(index), normal});
      }
    };
    append(row.first, other, second - before, row.normal);
    if (second < soft_count) append(row.second, Other::soft, row.first.body, -row.normal);
  }
}

template <class Real>
std::size_t CoupledStep<Real>::bytes() const {
  std::size_t sum = solver_.bytes() + (rows_.capacity() + warm_.capacity()) * sizeof(ContactRow) +
                    responses_.capacity() * sizeof(Response) + (x_.capacity() + residual_.capacity()) * sizeof(Vec3d);
  for (const Body& body : bodies_) {
    sum +=
        (body.start.capacity() + body.x0.capacity() + body.u0.capacity() + body.u.capacity() + body.step.capacity()) *
        sizeof(Vec3d);
  }
  return sum;
}

template class CoupledStep<float>;
template class CoupledStep<double>;

}  // namespace pneuma::physics
