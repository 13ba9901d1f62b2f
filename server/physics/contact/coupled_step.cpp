#include "physics/contact/coupled_step.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/contact/bounce_limit.h"
#include "physics/contact/coupled_rows.h"
#include "physics/contact/filter.h"
#include "physics/contact/rebound.h"
#include "physics/contact/resting_start.h"
#include "physics/contact/solver.h"
#include "physics/contact/spins.h"
#include "physics/contact/taken_energy.h"
#include "physics/forces/force_terms.h"
#include "physics/implicit/implicit_euler.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/rigid/rigid_motion.h"

namespace pneuma::physics {
namespace {

constexpr int coupled_passes = 4;
// Where these leave more energy than there was, the step goes on: by more than a share of the kinetic energy, and than
// what lifts the bodies by a share of the distance that they keep. A heap at rest would have all passes in each step.
constexpr int coupled_passes_max = 16;
constexpr double gained_share_max = 1e-2;
constexpr double gained_lift_share = 0.1;
constexpr std::uint32_t coupled_sweeps_max = 30;
// Of these many rows, a dense program of three times as many unknowns takes a few milliseconds.
constexpr std::size_t direct_rows_max = 160;
// What one side of a row changes is what all rows name of its body. Twice as much takes a second a step, and 64 MB. A
// sheet of 961 vertices that lies on a floor has a fourth of this; three on top of each other have thirty times that.
constexpr std::size_t coupled_changes_max = std::size_t{1} << 22U;
// Of the mean edge a substep: what rows may be off by.
constexpr double coupled_enough_share = 1e-6;
// The same of rows that are solved together in a pass that another follows, which finds its own place for them anyway.
// Ten times as much shakes a load on a soft ball, which then swings for ever.
constexpr double coupled_enough_early_share = 1e-3;
// The same of joints whose soft bodies are all frozen.
constexpr double joints_alone_enough_m_s = 1e-9;
// What a pass may move vertices by and be the last but one.
constexpr double pass_settled_share = 1e-3;
// Of the internal forces' moments: the stress stiffness of a body's rotations, as a bound from above.
constexpr double stress_share = 2.0;
// The edges' share of a pressure, as a stiffness that the springs do not have.
constexpr double pressure_share = 0.5;

}  // namespace

template <class Real>
bool CoupledStep<Real>::run(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces) {
  had_ways_out_ = false;
  begin(world, surfaces);
  find_coupled_rows(world, surfaces, passes_);
  list_resting(passes_, world.substep.dt_s, rests_);
  (void)take_touching(world, surfaces);
  bool is_settled = false;
  for (int pass = 0; pass < coupled_passes_max; ++pass) {
    for (CoupledBody& body : passes_.bodies) body.has_moved = false;
    do {
      move_freely(world, surfaces);
      find_coupled_rows(world, surfaces, passes_);
    } while (take_touching(world, surfaces));
    if (has_too_many_rows()) {
      least_.reset();
      passes_.rows = {};  // their room too: there are as many as a crowd may have
      responses_.clear();
      return false;
    }
    leave_out_failed();
    const bool is_last = is_settled || pass + 1 >= coupled_passes;
    const bool is_exact = solve(world, is_last ? coupled_enough_share : coupled_enough_early_share);
    take_answers(world, surfaces);
    is_settled = move_as_far_as_free(world, surfaces) <= pass_settled_share * least_spacing_m();
    const bool is_done = is_settled && (is_exact || is_last);
    if (is_done && !least_) break;
    if (pass + 1 < coupled_passes) continue;
    const double gained_j = is_any_driven() ? 0.0 : -taken_energy_j(world, passes_);
    const double kinetic_j = kinetic_energy_j(world, passes_);
    if (gained_j <= gained_share_max * kinetic_j + gained_lift_share * lift_energy_j(world, passes_)) {
      least_.reset();
      break;
    }
    if (!least_ || gained_j < least_->gained_j()) least_ = PassOutcome::of(passes_, stopped_, gained_j);
    if (is_done) break;
  }
  if (least_) {
    std::move(*std::exchange(least_, std::nullopt)).put_back(passes_, stopped_);
    keep_impulses(*world.warm);
  }
  stop_cut(world, surfaces);
  keep_spins(world, passes_);
  rebound(world, passes_);
  mark_broken(world);
  store(world);
  note(world);
  had_ways_out_ = std::ranges::any_of(passes_.rows, is_way_out);
  responses_.clear();  // large; the next step has its own
  return true;
}

template <class Real>
bool CoupledStep<Real>::has_too_many_rows() {
  sides_.assign(passes_.bodies.size(), 0);
  for (const ContactRow& row : passes_.rows) {
    for (const Support* side : {&row.first, &row.second}) {
      if (side->body < sides_.size()) ++sides_[side->body];
    }
  }
  std::size_t changes = 0;
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    if (sides_[i] > 0) changes += sides_[i] * std::min(passes_.bodies[i].u.size(), 3 * sides_[i]);
  }
  return changes > coupled_changes_max;
}

template <class Real>
void CoupledStep<Real>::begin(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces) {
  surfaces.load(world.soft, world.bounds, SurfaceContacts<Real>::Whose::all, 1.0);
  surfaces.find_pairs(world.soft);
  passes_.surfaces = &surfaces.bodies();
  passes_.joints_left_m.clear();
  load_bodies(world);
  load_solids(world);
  const auto first = static_cast<std::uint32_t>(world.soft.size());
  yields_.assign(first + passes_.solids.size() + 1, 1);
  for (std::size_t i = first + world.rigid.size(); i < yields_.size(); ++i) yields_[i] = 0;
}

template <class Real>
void CoupledStep<Real>::load_bodies(const CoupledWorld<Real>& world) {
  passes_.bodies.resize(world.soft.size());
  for (std::size_t i = 0; i < world.soft.size(); ++i) {
    const SoftState<Real>& state = world.soft[i];
    CoupledBody& body = passes_.bodies[i];
    body.in_contact = body.left_out = body.is_cut = false;
    if (!world.bounds[i].active) continue;
    const std::size_t count = state.x.size();
    body.is_free = !is_driven(state, world.substep.surroundings);
    for (std::vector<Vec3d>* points : {&body.start, &body.x0, &body.u0, &body.u}) points->resize(count);
    const bool awake = state.is_awake();
    for (std::size_t k = 0; k < count; ++k) {
      body.x0[k] = state.x[k].template cast<double>();
      body.start[k] = state.origin_m + body.x0[k];
      body.u0[k] = awake ? Vec3d(world.start_m_s[i][k].template cast<double>()) : Vec3d(Vec3d::Zero());
      body.u[k] = awake ? Vec3d(state.dr[k].template cast<double>() / world.substep.dt_s) : Vec3d(Vec3d::Zero());
    }
  }
}

template <class Real>
void CoupledStep<Real>::load_solids(const CoupledWorld<Real>& world) {
  passes_.solids.clear();
  const auto first = static_cast<std::uint32_t>(world.soft.size());
  for (const RigidState& rigid : world.rigid) {
    SolidPlace& solid = passes_.solids.emplace_back();
    solid.shape = &rigid.body.shape;
    solid.surface = &rigid.body.surface;
    solid.yields = true;
    solid.at = {rigid.position, rigid.orientation};
    solid.velocity = solid.ahead = rigid.velocity;
    solid.angular_velocity = solid.ahead_turning = rigid.angular_velocity;
  }
  for (const ColliderState& collider : world.colliders) {
    SolidPlace& solid = passes_.solids.emplace_back();
    solid.shape = &collider.collider.shape;
    solid.surface = &collider.collider.surface;
    solid.at = {collider.position, collider.orientation};
    solid.velocity = solid.ahead = collider.collider.velocity;
    solid.angular_velocity = solid.ahead_turning = collider.collider.angular_velocity;
  }
  for (std::size_t i = 0; i < passes_.solids.size(); ++i)
    passes_.solids[i].response = first + static_cast<std::uint32_t>(i);
  passes_.rigid_velocities_m_s.assign(world.rigid.size(), Vec3d::Zero());
  passes_.rigid_turnings_rad_s.assign(world.rigid.size(), Vec3d::Zero());
}

// A body that nothing touches as it goes freely may be touched as others are pushed. False where no body is new.
template <class Real>
bool CoupledStep<Real>::take_touching(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces) {
  bool any = false;
  for (const ContactRow& row : passes_.rows) {
    for (const Support* side : {&row.first, &row.second}) {
      if (side->body >= passes_.bodies.size()) continue;
      CoupledBody& body = passes_.bodies[side->body];
      if (body.in_contact || body.left_out) continue;
      if (world.first_order && !step_by_first_order(world, side->body, surfaces)) {
        world.soft[side->body].solve_failed = true;
        body.left_out = true;
        continue;
      }
      // Where the method's own step is taken by first order, the body's vibrations would be kept.
      if (rests_[side->body] != 0 && !world.first_order && world.soft[side->body].is_awake()) {
        choose_start(world.soft[side->body], passes_.surface(side->body).spacing_m, world.substep.dt_s, body);
      }
      body.in_contact = begin_metric(world, side->body);
      body.left_out = !body.in_contact;
      any = any || body.in_contact;
    }
  }
  return any;
}

// What holds or moves a body may do work on those that it touches.
template <class Real>
bool CoupledStep<Real>::is_any_driven() const {
  return std::ranges::any_of(passes_.bodies, [](const CoupledBody& body) { return body.in_contact && !body.is_free; });
}

// The velocities are those that nothing was cut for. Bodies out of contact keep theirs.
template <class Real>
void CoupledStep<Real>::stop_cut(const CoupledWorld<Real>& world, const SurfaceContacts<Real>& surfaces) {
  for (StoppedFeatures::Vertex& of : stopped_.vertices()) {
    if (of.body >= passes_.bodies.size()) {
      of.is_held = true;
      of.velocity_m_s = surfaces.mesh_move_m(of.body, of.vertex) / world.substep.dt_s;
      continue;
    }
    const CoupledBody& body = passes_.bodies[of.body];
    const SoftState<Real>& state = world.soft[of.body];
    of.is_held = !body.in_contact || !state.is_awake() || state.is_pinned(of.vertex);
    if (state.is_awake()) of.velocity_m_s = body.u[of.vertex];
    if (!of.is_held) of.mass_kg = state.mass_kg(of.vertex);
  }
  stopped_.stop();
  for (const StoppedFeatures::Vertex& of : stopped_.vertices()) {
    if (of.mass_kg > 0.0) passes_.bodies[of.body].u[of.vertex] = of.velocity_m_s;
  }
}

// What a solid may hold is not taken along by other surfaces.
template <class Real>
void CoupledStep<Real>::mark_free(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces) const {
  const std::size_t count = passes_.bodies.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (!world.bounds[i].active) continue;
    SurfaceBody& surface = surfaces.bodies()[i];
    physics::mark_free(world.soft[i], surface);
    for (std::size_t k = 0; k < surface.free.size(); ++k) {
      if (surface.cuts[k] < 1.0) surface.free[k] = 0;
    }
  }
  for (const ContactRow& row : passes_.rows) {
    const bool is_of_solid = row.second.body >= count && !surfaces.is_mesh(row.second.body);
    if (!is_of_solid || row.first.body >= count || surfaces.bodies()[row.first.body].free.empty()) continue;
    for (std::uint32_t k = 0; k < row.first.count; ++k) {
      surfaces.bodies()[row.first.body].free[row.first.vertices[k]] = 0;
    }
  }
}

template <class Real>
double CoupledStep<Real>::least_spacing_m() const {
  double spacing_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < passes_.bodies.size(); ++i) {
    if (passes_.bodies[i].in_contact) spacing_m = std::min(spacing_m, passes_.surface(i).spacing_m);
  }
  return spacing_m;
}

// Those in contact that have not moved in this pass yet.
template <class Real>
void CoupledStep<Real>::move_freely(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces) {
  for (std::size_t i = 0; i < passes_.bodies.size(); ++i) {
    CoupledBody& body = passes_.bodies[i];
    if (!body.in_contact || body.has_moved) continue;
    body.has_moved = true;
    if (!step_freely(world, i)) {
      world.soft[i].solve_failed = true;
      body.in_contact = false;
      body.left_out = true;
      continue;
    }
    SurfaceBody& surface = surfaces.bodies()[i];
    for (std::size_t k = 0; k < body.u.size(); ++k) surface.to[k] = body.start[k] + world.substep.dt_s * body.u[k];
  }
}

template <class Real>
void CoupledStep<Real>::leave_out_failed() {
  const auto left_out = [&](const Support& side) {
    return side.body < passes_.bodies.size() && passes_.bodies[side.body].left_out;
  };
  std::erase_if(passes_.rows, [&](const ContactRow& row) { return left_out(row.first) || left_out(row.second); });
}

// Newton's step without contact, in the metric of the passes. False where it is not finite.
template <class Real>
bool CoupledStep<Real>::step_freely(const CoupledWorld<Real>& world, std::size_t index) {
  SoftState<Real>& state = world.soft[index];
  CoupledBody& body = passes_.bodies[index];
  const double s = world.substep.dt_s;
  const SubstepContext untimed = world.substep.of_body(nullptr, nullptr);  // it counts as contact
  const std::vector<double>& masses_kg = body.masses_kg();
  const std::size_t count = body.u.size();
  if (!state.is_awake()) {
    residual_.assign(count, Vec3d::Zero());
    body.metric.move_to({body.x0, {}, 0.0, 0.0}, residual_, body.step);
    return true;
  }
  x_.resize(count);
  for (std::size_t i = 0; i < count; ++i) x_[i] = body.x0[i] + s * body.u[i];
  const std::span<const Vec3d> f = solver_.force(state, world.tables[index], x_, body.u, untimed);
  residual_.resize(count);
  Vec3d sum = Vec3d::Zero();
  double stress_n_m = 0.0;
  const Vec3d centre = weighted_sum(masses_kg, x_) / total(masses_kg);
  for (std::size_t i = 0; i < count; ++i) {
    const double mass_kg = state.mass_kg(i);
    residual_[i] = mass_kg * (body.u0[i] - body.u[i]) + s * f[i];
    if (state.is_pinned(i)) residual_[i].setZero();
    sum += residual_[i];
    stress_n_m += (f[i] - mass_kg * world.substep.surroundings.gravity).norm() * (x_[i] - centre).norm();
  }
  if (!sum.allFinite()) return false;
  const std::span<const Vec3d> gradient = solver_.volume_gradient_m2();
  const double gas = s * s * volume_stiffness_pa_m3(state);
  body.stress_n_m = stress_share * stress_n_m;
  body.metric.move_to({x_, gradient, gas, body.stress_n_m}, residual_, body.step);
  if (body.is_free) {
    const Vec3d missing = (sum - weighted_sum(masses_kg, body.step)) / total(masses_kg);
    for (Vec3d& step : body.step) step += missing;
  }
  for (std::size_t i = 0; i < count; ++i) body.u[i] += body.step[i];
  return true;
}

// The passes are implicit Euler's, so they start from its step. False where it fails.
template <class Real>
bool CoupledStep<Real>::step_by_first_order(const CoupledWorld<Real>& world, std::size_t index,
                                            SurfaceContacts<Real>& surfaces) {
  CoupledBody& body = passes_.bodies[index];
  SoftState<Real>& state = world.soft[index];
  if (!state.is_awake()) return true;
  state.v = world.start_m_s[index];
  if (!euler_again(state, world.tables[index], *world.first_order, world.substep, solver_)) return false;
  SurfaceBody& surface = surfaces.bodies()[index];
  for (std::size_t k = 0; k < body.u.size(); ++k) {
    body.u[k] = state.v[k].template cast<double>();
    surface.to[k] = body.start[k] + world.substep.dt_s * body.u[k];
  }
  return true;
}

// False where the body has no matrix.
template <class Real>
bool CoupledStep<Real>::begin_metric(const CoupledWorld<Real>& world, std::size_t index) {
  CoupledBody& body = passes_.bodies[index];
  const SoftState<Real>& state = world.soft[index];
  ImplicitTables<Real>& tables = world.tables[index];
  const double stress_n_m =
      state.gas ? pressure_share * std::max(0.0, state.pressure_pa) * passes_.surface(index).spacing_m : 0.0;
  tables.matrices->update(tables.held.touching, state, world.substep.surroundings, world.substep.dt_s, stress_n_m);
  if (!tables.held.touching) return false;
  x_.resize(body.u.size());  // where it is about to be: rotations from where it was would shear it
  for (std::size_t k = 0; k < x_.size(); ++k) x_[k] = body.x0[k] + world.substep.dt_s * body.u[k];
  body.metric.begin(*tables.held.touching, body.is_free, x_);
  return true;
}

// `share`: what rows that are solved together may be off by. True where all are within what rows may be off by.
template <class Real>
bool CoupledStep<Real>::solve(const CoupledWorld<Real>& world, double share) {
  list_responses(world);
  double spacing_m = 0.0;
  for (ContactRow& row : passes_.rows) {
    for (Support* side : {&row.first, &row.second}) {
      if (auto* response = std::get_if<FactoredResponse>(&responses_[side->body])) {
        response->add(*side);
        spacing_m = std::max(spacing_m, passes_.surface(side->body).spacing_m);
      }
    }
    warm(*world.warm, row);
  }
  for (Response& response : responses_) {
    if (auto* factored = std::get_if<FactoredResponse>(&response)) factored->finish();
  }
  group_rows(passes_.rows, yields_, groups_);
  const double spacing_m_s = spacing_m / world.substep.dt_s;
  const SolveLimits limits{
      .sweeps_max = coupled_sweeps_max,
      .enough_m_s = spacing_m > 0.0 ? coupled_enough_share * spacing_m_s : joints_alone_enough_m_s,
      .direct_rows_max = direct_rows_max,
      .direct_enough_m_s = share * spacing_m_s,
  };
  bool is_exact = true;
  for (const RowGroup& group : groups_) {
    const auto rows = std::span(passes_.rows).subspan(group.begin, group.end - group.begin);
    const SolveOutcome outcome = solve_rows(rows, responses_, limits);
    const bool converged = limit_parting(rows, responses_, limits) && outcome.converged;
    counts_.unconverged += converged ? 0 : 1;
    is_exact = is_exact && outcome.off_m_s <= limits.enough_m_s;
  }
  counts_.rows += passes_.rows.size();
  keep_impulses(*world.warm);
  return is_exact;
}

template <class Real>
void CoupledStep<Real>::keep_impulses(std::vector<WarmImpulse>& warm) const {
  warm.clear();
  for (const ContactRow& row : passes_.rows) {
    if (row.impulse_n_s.allFinite() && !row.impulse_n_s.isZero(0.0)) warm.push_back({row.key, row.impulse_n_s});
  }
  std::ranges::sort(warm, {}, &WarmImpulse::key);
}

template <class Real>
void CoupledStep<Real>::list_responses(const CoupledWorld<Real>& world) {
  const std::size_t soft_count = passes_.bodies.size();
  responses_.clear();
  for (std::size_t i = 0; i < soft_count; ++i) {
    if (passes_.bodies[i].in_contact) {
      responses_.emplace_back(FactoredResponse(passes_.bodies[i].metric));
    } else {
      responses_.emplace_back(FixedResponse{});
    }
  }
  for (const RigidState& rigid : world.rigid) {
    responses_.emplace_back(RigidResponse(inverse_masses_1_kg(rigid), inverse_inertia_1_kg_m2(rigid)));
  }
  for (std::size_t i = 0; i <= world.colliders.size(); ++i) responses_.emplace_back(FixedResponse{});
}

// The impulses of the pass before, or of the last one of the step before, within what the row may have now.
template <class Real>
void CoupledStep<Real>::warm(std::span<const WarmImpulse> all, ContactRow& row) {
  const auto before = std::ranges::lower_bound(all, row.key, {}, &WarmImpulse::key);
  if (before == all.end() || before->key != row.key) return;
  if (joint_of(row)) {
    row.impulse_n_s = before->impulse_n_s;
    if (row.kind == RowKind::guide) row.impulse_n_s -= row.impulse_n_s.dot(row.normal) * row.normal;
    if (row.kind == RowKind::contact) {
      row.impulse_n_s = std::max(0.0, row.impulse_n_s.dot(row.normal)) * row.normal;
    }
    return;
  }
  const double pressed_n_s = std::max(0.0, before->impulse_n_s.dot(row.normal));
  const Vec3d rubbed_n_s = before->impulse_n_s - before->impulse_n_s.dot(row.normal) * row.normal;
  const double most_n_s = row.friction * pressed_n_s;
  const double rubbed = rubbed_n_s.norm();
  row.impulse_n_s = pressed_n_s * row.normal + (rubbed > most_n_s ? most_n_s / rubbed : 1.0) * rubbed_n_s;
}

// Where the impulses send everybody.
template <class Real>
void CoupledStep<Real>::take_answers(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces) {
  const double s = world.substep.dt_s;
  for (std::size_t i = 0; i < passes_.bodies.size(); ++i) {
    CoupledBody& body = passes_.bodies[i];
    if (!body.in_contact) continue;
    const std::vector<double>& masses_kg = body.masses_kg();
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
    const auto& response = std::get<RigidResponse>(responses_[passes_.bodies.size() + k]);
    const Vec3d velocity = world.rigid[k].velocity + response.velocity_change_m_s();
    const Vec3d turning = world.rigid[k].angular_velocity + response.turning_change_rad_s();
    passes_.solids[k].ahead = velocity - passes_.rigid_velocities_m_s[k];
    passes_.solids[k].ahead_turning = turning - passes_.rigid_turnings_rad_s[k];
    passes_.rigid_velocities_m_s[k] = velocity;
    passes_.rigid_turnings_rad_s[k] = turning;
  }
}

// Goes as far towards that as nothing crosses, also with bodies that only pass by: solids cut the moves first, and the
// surfaces then look at what is left. Returns how far a vertex in contact is from where the pass began.
template <class Real>
double CoupledStep<Real>::move_as_far_as_free(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces) {
  const double s = world.substep.dt_s;
  double furthest_m2 = 0.0;
  surfaces.update_candidates(world.soft);
  surfaces.carry(passes_.bodies.size());
  for (SolidPlace& solid : passes_.solids) set_way(solid, s);
  for (std::size_t i = 0; i < passes_.bodies.size(); ++i) {
    if (!passes_.bodies[i].in_contact) continue;
    SurfaceBody& surface = surfaces.bodies()[i];
    const Box way = surface.box_of_moves();
    for (const SolidPlace& solid : passes_.solids) {
      if (may_meet(surface, way, solid)) passes_.solid_cutter.cut(surface, solid, s);
    }
  }
  for (std::size_t i = 0; i < passes_.bodies.size(); ++i) {
    if (!world.bounds[i].active || !passes_.bodies[i].in_contact) continue;
    const SurfaceBody& surface = surfaces.bodies()[i];
    for (std::uint32_t k = 0; k < surface.from.size(); ++k) {
      furthest_m2 = std::max(furthest_m2, surface.move_m(k).squaredNorm());
    }
  }
  mark_free(world, surfaces);
  stopped_ = surfaces.filter(world.soft);
  for (const StoppedFeatures::Vertex& of : stopped_.vertices()) {
    const bool is_taken_along = of.body < passes_.bodies.size() && surfaces.bodies()[of.body].cuts[of.vertex] == 1.0;
    if (!is_taken_along || of.missed_m.isZero(0.0)) continue;
    ++counts_.cut_vertices;
    passes_.bodies[of.body].is_cut = true;
  }
  for (std::size_t i = passes_.bodies.size(); i < surfaces.bodies().size(); ++i) {
    SurfaceBody& mesh = surfaces.bodies()[i];
    mesh.from = mesh.to;
    std::ranges::fill(mesh.cuts, 1.0);
  }
  for (std::size_t i = 0; i < passes_.bodies.size(); ++i) {
    if (!world.bounds[i].active) continue;
    CoupledBody& body = passes_.bodies[i];
    SurfaceBody& surface = surfaces.bodies()[i];
    for (std::uint32_t k = 0; k < surface.from.size(); ++k) {
      const bool is_cut = surface.cuts[k] < 1.0 && !surface.move_m(k).isZero(0.0);
      surface.from[k] += surface.cut_move_m(k);
      surface.cuts[k] = 1.0;
      if (!is_cut) continue;
      ++counts_.cut_vertices;
      body.is_cut = true;
    }
    surface.drifts.clear();
  }
  for (const StoppedFeatures::Vertex& of : stopped_.vertices()) {
    if (of.body >= passes_.bodies.size()) continue;
    SurfaceBody& surface = surfaces.bodies()[of.body];
    surface.to[of.vertex] = surface.from[of.vertex] + of.missed_m;  // also where it was taken along
  }
  for (std::size_t k = 0; k < passes_.solids.size(); ++k) {
    SolidPlace& solid = passes_.solids[k];
    const Quatd orientation = turned(Quatd(solid.at.rotation), solid.ahead_turning, s);
    solid.at = {solid.at.origin + s * solid.ahead, orientation};
    const bool is_rigid = k < world.rigid.size();
    solid.ahead = is_rigid ? Vec3d(solid.velocity - passes_.rigid_velocities_m_s[k]) : Vec3d(Vec3d::Zero());
    solid.ahead_turning =
        is_rigid ? Vec3d(solid.angular_velocity - passes_.rigid_turnings_rad_s[k]) : Vec3d(Vec3d::Zero());
  }
  return std::sqrt(furthest_m2);
}

template <class Real>
void CoupledStep<Real>::mark_broken(const CoupledWorld<Real>& world) const {
  for (const ContactRow& row : passes_.rows) {
    if (joint_of(row) && has_given_way(row)) world.joints[*joint_of(row)].broken = true;
  }
}

template <class Real>
void CoupledStep<Real>::store(const CoupledWorld<Real>& world) {
  for (std::size_t i = 0; i < passes_.bodies.size(); ++i) {
    const CoupledBody& body = passes_.bodies[i];
    if (!body.in_contact && !body.is_cut) continue;
    SoftState<Real>& state = world.soft[i];
    const SurfaceBody& surface = passes_.surface(i);
    state.dr.resize(state.x.size());
    for (std::size_t k = 0; k < body.u.size(); ++k) {
      const Vec3d move = surface.from[k] - body.start[k];
      state.dr[k] = state.is_pinned(k) ? Vec3<Real>(Vec3<Real>::Zero()) : Vec3<Real>(move.template cast<Real>());
      if (body.in_contact) state.v[k] = body.u[k].template cast<Real>();
    }
  }
  for (std::size_t k = 0; k < world.rigid.size(); ++k) {
    world.rigid[k].velocity = passes_.rigid_velocities_m_s[k];
    world.rigid[k].angular_velocity = passes_.rigid_turnings_rad_s[k];
  }
}

template <class Real>
void CoupledStep<Real>::note(const CoupledWorld<Real>& world) const {
  const std::size_t soft_count = passes_.bodies.size();
  const std::size_t solid_count = soft_count + world.rigid.size();  // and what does not give way
  const auto ref_of = [&](std::size_t response) {
    if (response < soft_count) return BodyRef{BodyKind::soft, static_cast<std::uint32_t>(response)};
    if (response < solid_count) return BodyRef{BodyKind::rigid, static_cast<std::uint32_t>(response - soft_count)};
    return BodyRef{BodyKind::collider, static_cast<std::uint32_t>(response - solid_count)};
  };
  const auto mark = [&](BodyRef body) {
    if (body.kind == BodyKind::soft) world.soft_touched[body.index] = 1;
    if (body.kind == BodyKind::rigid) world.rigid_touched[body.index] = 1;
  };
  for (const ContactRow& row : passes_.rows) {
    if (joint_of(row) || !(row.impulse_n_s.dot(row.normal) > 0.0)) continue;
    const BodyRef first = ref_of(row.first.body);
    const BodyRef second = ref_of(row.second.body);
    mark(first);
    mark(second);
    if (world.touches != nullptr) world.touches->add(first, second, row.impulse_n_s, place_of(row.first), row.normal);
    if (world.notes.empty()) continue;
    const auto append = [&](const Support& of, BodyRef other, const Vec3d& normal) {
      for (std::uint32_t i = 0; i < of.count; ++i) world.notes[of.body].push_back({of.vertices[i], other, normal});
    };
    if (first.kind == BodyKind::soft) append(row.first, second, row.normal);
    if (second.kind == BodyKind::soft) append(row.second, first, -row.normal);
  }
}

// Where the row acts.
template <class Real>
Vec3d CoupledStep<Real>::place_of(const Support& side) const {
  const std::size_t soft_count = passes_.bodies.size();
  if (side.body < soft_count) return mean_of(side, passes_.surface(side.body).from);
  return passes_.solids[side.body - soft_count].at.origin + side.arm;
}

template <class Real>
std::size_t CoupledStep<Real>::bytes() const {
  std::size_t sum = solver_.bytes() + passes_.rows.capacity() * sizeof(ContactRow) +
                    responses_.capacity() * sizeof(Response) + passes_.solid_rows.bytes() +
                    passes_.solid_cutter.bytes() + (x_.capacity() + residual_.capacity()) * sizeof(Vec3d);
  sum += stopped_.bytes() + sides_.capacity() * sizeof(std::size_t);
  for (const CoupledBody& body : passes_.bodies) {
    sum +=
        (body.start.capacity() + body.x0.capacity() + body.u0.capacity() + body.u.capacity() + body.step.capacity()) *
        sizeof(Vec3d);
  }
  return sum;
}

template class CoupledStep<float>;
template class CoupledStep<double>;

}  // namespace pneuma::physics
