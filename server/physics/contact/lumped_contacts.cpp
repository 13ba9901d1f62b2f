#include "physics/contact/lumped_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/contact/filter.h"
#include "physics/rigid/contact_surface.h"
#include "physics/rigid/rigid_mass.h"

namespace pneuma::physics {
namespace {

// Rows hold while two bodies move by no more than this share of their vertices' spacing beside each other. Of five
// balls it makes two spans a tick, and the filter cuts a vertex in a hundred. Past 0.6 a heap of a hundred balls is no
// longer settled by its rows: each span leaves more to the filter than the one before.
constexpr double span_share = 0.5;
// What begins the substep nearer than the kept distance goes back to it within this time. At once, the springs would be
// fed.
constexpr double skin_overlap_time_s = 0.1;
// But a vertex from a solid by this share of the spacing a substep at least, so that little is seen in it.
constexpr double out_of_solid_share = 0.02;
// The solve of velocities starts from the impulses of the substep before. Eight sweeps kept a heap of eight balls awake
// for 15 s in place of 17, and took a tenth longer.
constexpr std::uint32_t sweeps_max = 5;
// Of the largest approach: what a sweep may change and be the last. Ten times as much leaves a tremble that keeps piles
// awake three times as long.
constexpr double enough_share = 2e-3;

template <class Real>
bool has_solids(const ContactWorld<Real>& world) {
  return !world.rigid.empty() || !world.colliders.empty();
}

}  // namespace

template <class Real>
void LumpedContacts<Real>::answer(const Substep& substep, SurfaceContacts<Real>& surfaces) {
  const SubstepContext& context = substep.world.substep;
  moments_.begin(substep.world.soft.size() + substep.world.rigid.size(), context.is_first_of_tick);
  if (substeps_left_ == 0 || context.is_first_of_tick) begin_span(substep, surfaces);
  counts_.rows += rows_.size();
  if (!rows_.empty()) {
    load_values(substep, surfaces);
    measure(substep);
    list_due(substep, surfaces);
    solve_velocities(substep);
    note(substep, surfaces);
    add_moments(substep, surfaces);
    solve_moves(substep, surfaces);
    store(substep);
  }
  if (context.is_last_of_tick()) moments_.turn_back(substep.world.soft, substep.world.rigid);
}

template <class Real>
void LumpedContacts<Real>::begin_span(const Substep& substep, SurfaceContacts<Real>& surfaces) {
  using Whose = typename SurfaceContacts<Real>::Whose;
  const ContactWorld<Real>& world = substep.world;
  const Whose whose = has_solids(world) ? Whose::all : Whose::of_those_that_meet;
  substeps_left_ = world.substep.substeps_left;
  awake_.clear();
  for (const SoftState<Real>& state : world.soft) awake_.push_back(state.is_awake() ? 1 : 0);
  for (const RigidState& state : world.rigid) awake_.push_back(state.is_awake() ? 1 : 0);
  if (std::ranges::any_of(surfaces.meshes(), &MeshCollider::moves)) substeps_left_ = 1;
  surfaces.load(world.soft, substep.bounds, whose, substeps_left_);
  const double held = substeps_that_rows_hold(substep, surfaces);
  if (held < substeps_left_) {
    substeps_left_ = static_cast<std::uint32_t>(std::max(1.0, held));
    surfaces.load(world.soft, substep.bounds, whose, substeps_left_);
  }
  keep_impulses(!world.substep.is_first_of_tick);
  surfaces.find_pairs(world.soft);
  find_rows(substep, surfaces);
  take_impulses();
  solver_.load(rows_, surfaces.bodies(), world.rigid.size());
}

// Nobody has been woken or frozen since.
template <class Real>
bool LumpedContacts<Real>::is_as_begun(const ContactWorld<Real>& world) const {
  auto before = awake_.begin();
  const auto is_same = [&before](const auto& state) { return (*before++ != 0) == state.is_awake(); };
  return std::ranges::all_of(world.soft, is_same) && std::ranges::all_of(world.rigid, is_same);
}

template <class Real>
double LumpedContacts<Real>::substeps_that_rows_hold(const Substep& substep, SurfaceContacts<Real>& surfaces) const {
  double least = substeps_left_;
  const std::span<const SurfaceBody> bodies = surfaces.bodies();
  surfaces.for_near(substep.world.soft, [&](std::uint32_t first, std::uint32_t second) {
    const double a_substep_m = between_m(bodies[first].substep, bodies[second].substep);
    const double spacing_m = std::min(bodies[first].spacing_m, bodies[second].spacing_m);
    if (least * a_substep_m > span_share * spacing_m) least = span_share * spacing_m / a_substep_m;
  });
  return least;
}

template <class Real>
void LumpedContacts<Real>::find_rows(const Substep& substep, SurfaceContacts<Real>& surfaces) {
  rows_.clear();
  surfaces.find_rows(rows_);
  surfaces.add_ways_out(rows_);
  turns_.sort(rows_, surfaces.bodies());
  skin_rows_ = rows_.size();
  kept_m_.clear();
  const auto place_m = [&](const Support& of) { return mean_of(of, surfaces.bodies()[of.body].from); };
  for (const ContactRow& row : rows_) {
    kept_m_.push_back((place_m(row.first) - place_m(row.second)).dot(row.normal) - row.gap_m);
  }
  if (!has_solids(substep.world)) return;
  const StageTimer timer(substep.world.substep.profile, Stage::solid_contact, substep.stage);
  solids_.find_rows(substep.world, surfaces.bodies(), surfaces.loaded(),
                    static_cast<std::uint32_t>(surfaces.bodies().size()), substeps_left_, rows_);
}

template <class Real>
void LumpedContacts<Real>::keep_impulses(bool of_this_tick) {
  warm_.clear();
  for (std::size_t r = 0; of_this_tick && r < rows_.size(); ++r) {
    if (solver_.impulses()[r].pressed_n_s > 0.0) warm_.push_back({rows_[r].key, solver_.impulse_n_s(r)});
  }
  std::ranges::sort(warm_, {}, &WarmImpulse::key);
}

template <class Real>
void LumpedContacts<Real>::take_impulses() {
  for (ContactRow& row : rows_) {
    const auto before = std::ranges::lower_bound(warm_, row.key, {}, &WarmImpulse::key);
    row.impulse_n_s = before != warm_.end() && before->key == row.key ? before->impulse_n_s : Vec3d(Vec3d::Zero());
  }
}

template <class Real>
void LumpedContacts<Real>::load_values(const Substep& substep, const SurfaceContacts<Real>& surfaces) {
  const ContactWorld<Real>& world = substep.world;
  const std::span<const LumpedSolver::Slot> slots = solver_.slots();
  places_m_.resize(4 * slots.size(), 0.0);
  velocities_m_s_.resize(4 * slots.size(), 0.0);
  moves_m_.resize(4 * slots.size(), 0.0);
  for (std::size_t s = 0; s < slots.size(); ++s) {
    const auto [body, vertex] = slots[s];
    const auto put = [s](const Vec3d& value, LumpedSolver::Values& values) {
      values[4 * s] = value.x();
      values[4 * s + 1] = value.y();
      values[4 * s + 2] = value.z();
      values[4 * s + 3] = 0.0;
    };
    if (body < world.soft.size()) {
      const SoftState<Real>& state = world.soft[body];
      put(state.position_m(vertex), places_m_);
      put(state.v[vertex].template cast<double>(), velocities_m_s_);
      put(state.is_awake() ? Vec3d(state.dr[vertex].template cast<double>()) : Vec3d(Vec3d::Zero()), moves_m_);
    } else if (body < surfaces.bodies().size()) {
      const SurfaceBody& mesh = surfaces.bodies()[body];
      put(mesh.from[vertex], places_m_);
      put(mesh.move_m(vertex) / world.substep.dt_s, velocities_m_s_);
      put(mesh.move_m(vertex), moves_m_);
    } else {  // a solid's point: as measured
      put(Vec3d::Zero(), places_m_);
      put(Vec3d::Zero(), velocities_m_s_);
      put(Vec3d::Zero(), moves_m_);
    }
  }
  for (std::size_t r = 0; r < world.rigid.size(); ++r) {
    const RigidState& state = world.rigid[r];
    solver_.rigid()[r] = {state.velocity, state.angular_velocity, Vec3d::Zero(), inverse_masses_1_kg(state),
                          inverse_inertia_1_kg_m2(state)};
  }
}

template <class Real>
void LumpedContacts<Real>::measure(const Substep& substep) {
  for (auto* numbers : {&gaps_m_, &opening_m_s_, &ends_m_, &least_m_}) numbers->resize(rows_.size());
  solver_.project(places_m_, skin_rows_, gaps_m_);
  for (std::size_t r = 0; r < skin_rows_; ++r) gaps_m_[r] -= kept_m_[r];
  solver_.project(velocities_m_s_, skin_rows_, opening_m_s_);
  for (std::size_t r = 0; r < skin_rows_; ++r) {
    ends_m_[r] = gaps_m_[r] + substep.world.substep.dt_s * opening_m_s_[r];
  }
  if (rows_.size() == skin_rows_) return;
  const StageTimer timer(substep.world.substep.profile, Stage::solid_contact, substep.stage);
  solids_.measure(substep.world, skin_rows_, solver_, places_m_, velocities_m_s_, moves_m_,
                  {gaps_m_, ends_m_, opening_m_s_});
}

// What is not there yet may come as near as its gap.
template <class Real>
void LumpedContacts<Real>::list_due(const Substep& substep, const SurfaceContacts<Real>& surfaces) {
  const double dt_s = substep.world.substep.dt_s;
  due_.clear();
  hits_.clear();
  wholes_.assign(substep.world.soft.size(), {});
  fastest_m_s_ = 0.0;
  for (std::uint32_t r = 0; r < rows_.size(); ++r) {
    LumpedImpulse& impulse = solver_.impulses()[r];
    const double near_m = is_of_solid(r) ? solid_slack_share * surfaces.bodies()[rows_[r].first.body].spacing_m
                                         : row_slack_share * kept_m_[r];
    if (std::min(gaps_m_[r], ends_m_[r]) > near_m && impulse.pressed_n_s == 0.0) continue;
    (!is_of_solid(r) ? due_.skins : solids_.is_rigid(r - skin_rows_) ? due_.rigid : due_.fixed).push_back(r);
    impulse.least_m_s = -std::max(gaps_m_[r], 0.0) / dt_s;
    fastest_m_s_ = std::max(fastest_m_s_, std::abs(opening_m_s_[r]));
    if (ends_m_[r] >= 0.0 || opening_m_s_[r] >= 0.0) continue;
    const double share = gaps_m_[r] > 0.0 ? gaps_m_[r] / (gaps_m_[r] - ends_m_[r]) : 0.0;
    const double impact = impact_m_s(substep, surfaces, r, share);
    const bool hits_solid = is_of_solid(r) && rows_[r].first.count == 1 && solver_.gives_way(r);
    if (impact < 0.0 || hits_solid) impulse.least_m_s = -rows_[r].restitution * impact;
    if (hits_solid) hits_.push_back({r, share});
  }
}

// What restitution acts on: not on what gravity adds after the impact.
template <class Real>
double LumpedContacts<Real>::impact_m_s(const Substep& substep, const SurfaceContacts<Real>& surfaces, std::uint32_t r,
                                        double share) {
  if (!may_bounce(substep, surfaces, r)) return 0.0;
  const SubstepPhysics physics = substep.world.physics();
  const bool both_fall = is_of_solid(r) && solids_.is_rigid(r - skin_rows_);
  const double falls = both_fall ? 0.0 : surfaces.is_mesh(rows_[r].first.body) ? -1.0 : 1.0;
  const double gained_m_s = falls * (1.0 - share) * physics.dt_s * solver_.normal(r).dot(physics.gravity_m_s2);
  return impact_speed(opening_m_s_[r], gained_m_s, physics.resting_m_s);
}

// A vertex that hits a solid does, unless its own body presses it against it. Not one that hits another skin: what it
// would bounce off is a few grams, and the springs and the gas behind both give back what they took.
template <class Real>
bool LumpedContacts<Real>::may_bounce(const Substep& substep, const SurfaceContacts<Real>& surfaces, std::uint32_t r) {
  const ContactRow& row = rows_[r];
  if (row.restitution == 0.0) return false;
  const bool soft_first = !surfaces.is_mesh(row.first.body);
  if (!is_of_solid(r) && soft_first && !surfaces.is_mesh(row.second.body)) return false;
  if (is_of_solid(r) && row.first.count > 1) return false;  // nor an edge or a face
  const Whole& whole = whole_of(substep, surfaces, soft_first ? row.first.body : row.second.body);
  if (gaps_m_[r] > whole.touching_m) return true;
  Vec3d of_solid_m_s = Vec3d::Zero();
  if (is_of_solid(r)) {
    of_solid_m_s = solids_.velocity_m_s(r - skin_rows_);
  } else {
    const Support& on_mesh = soft_first ? row.second : row.first;
    const SurfaceBody& mesh = surfaces.bodies()[on_mesh.body];
    for (std::uint32_t i = 0; i < on_mesh.count; ++i) {
      of_solid_m_s += on_mesh.weights[i] / substep.world.substep.dt_s * mesh.move_m(on_mesh.vertices[i]);
    }
  }
  const double sign = soft_first ? 1.0 : -1.0;
  return sign * (whole.velocity_m_s - of_solid_m_s).dot(solver_.normal(r)) < -substep.world.physics().resting_m_s;
}

// Coordinates of the body's precision cannot tell a smaller gap from none.
template <class Real>
auto LumpedContacts<Real>::whole_of(const Substep& substep, const SurfaceContacts<Real>& surfaces, std::uint32_t body)
    -> const Whole& {
  Whole& whole = wholes_[body];
  if (whole.is_known) return whole;
  const SoftState<Real>& state = substep.world.soft[body];
  const Box& box = surfaces.bodies()[body].way;
  const auto furthest_m = [&](const Vec3d& origin) {
    return (box.low - origin).cwiseAbs().cwiseMax((box.high - origin).cwiseAbs()).maxCoeff();
  };
  const double in_body_m = static_cast<double>(std::numeric_limits<Real>::epsilon()) * furthest_m(state.origin_m);
  const double in_world_m = std::numeric_limits<double>::epsilon() * furthest_m(Vec3d::Zero());
  whole.touching_m =
      std::max(touching_share * static_cast<double>(state.length_m), 4.0 * std::max(in_body_m, in_world_m));
  whole.velocity_m_s = mean_velocity(state);
  whole.is_known = true;
  return whole;
}

template <class Real>
void LumpedContacts<Real>::solve_velocities(const Substep& substep) {
  velocities_before_m_s_ = velocities_m_s_;
  if (!hits_.empty()) free_moves_m_ = moves_m_;
  solver_.push(velocities_m_s_);
  const SolveOutcome outcome =
      solver_.solve(due_, {.sweeps_max = sweeps_max, .enough_m_s = enough_share * fastest_m_s_}, velocities_m_s_);
  counts_.unconverged += outcome.converged ? 0 : 1;
  const double dt_s = substep.world.substep.dt_s;
  for (std::size_t i = 0; i < moves_m_.size(); ++i) {
    moves_m_[i] += dt_s * (velocities_m_s_[i] - velocities_before_m_s_[i]);
  }
  take_back_pushes(substep.world.substep);
  slide_hits(dt_s);
}

// A row that only keeps a skin from going further into a solid says nothing of the move that the skin makes, where the
// method does not move by the velocity that a substep ends with. (Where it does, the moves are solved to the same.) Of
// a vertex and a rigid body it stays: their angular momentum counts on it.
template <class Real>
void LumpedContacts<Real>::take_back_pushes(const SubstepContext& context) {
  const bool moves_by_velocity = context.integrator == Integrator::symplectic_euler || !is_explicit(context.integrator);
  for (const auto* list : {&due_.rigid, &due_.fixed}) {
    const bool is_rigid = list == &due_.rigid;
    if (is_rigid && moves_by_velocity) continue;
    auto hit = hits_.begin();
    for (const std::uint32_t r : *list) {
      while (hit != hits_.end() && hit->row < r) ++hit;
      const bool hits = hit != hits_.end() && hit->row == r;
      const bool stays = hits || (is_rigid && rows_[r].first.count == 1);
      if (!stays && solver_.impulses()[r].pressed_n_s > 0.0) solver_.take_back(r, context.dt_s, moves_m_);
    }
  }
}

// What hits a solid goes there as it came, and for the rest of the substep slides along it: it parts in the next one.
template <class Real>
void LumpedContacts<Real>::slide_hits(double dt_s) {
  for (const Hit& hit : hits_) {
    const std::size_t slot = 4 * solver_.skin_slot(hit.row);
    const Vec3d after_m_s = Vec3d::Map(velocities_m_s_.data() + slot);
    const Vec3d normal = solver_.normal(hit.row);
    const std::size_t row = hit.row - skin_rows_;
    const bool is_rigid = solids_.is_rigid(row);
    const Vec3d of_solid_m_s = is_rigid ? solver_.rigid_velocity_m_s(hit.row) : solids_.velocity_m_s(row);
    const Vec3d relative_m_s = after_m_s - of_solid_m_s;
    const Vec3d slide_m = (1.0 - hit.share) * dt_s * (relative_m_s - relative_m_s.dot(normal) * normal);
    const Vec3d free_m = Vec3d::Map(free_moves_m_.data() + slot);
    Eigen::Map<Vec3d> move_m(moves_m_.data() + slot);
    if (is_rigid) {
      move_m = hit.share * free_m + (1.0 - hit.share) * dt_s * of_solid_m_s + slide_m;
    } else {
      move_m = solids_.move_to_slide_m(row, Vec3d::Map(places_m_.data() + slot), free_m, hit.share, slide_m);
    }
  }
}

// Moves alone: what is nearer than it should be goes back without a velocity, which would be energy.
template <class Real>
void LumpedContacts<Real>::solve_moves(const Substep& substep, const SurfaceContacts<Real>& surfaces) {
  const double dt_s = substep.world.substep.dt_s;
  const double back_share = std::min(1.0, dt_s / skin_overlap_time_s);
  solver_.project(moves_m_, rows_.size(), ends_m_);
  bool any_short = false;
  for (const auto* list : {&due_.skins, &due_.rigid, &due_.fixed}) {
    for (const std::uint32_t r : *list) {
      double back_m = -back_share * gaps_m_[r];
      if (is_of_solid(r) && rows_[r].first.count == 1) {
        const double out_m = out_of_solid_share * surfaces.bodies()[rows_[r].first.body].spacing_m;
        back_m = std::min(-gaps_m_[r], std::max(back_m, out_m));
      }
      least_m_[r] = gaps_m_[r] > 0.0 ? -gaps_m_[r] : back_m;
      if (list == &due_.rigid) least_m_[r] += dt_s * solver_.rigid_velocity_m_s(r).dot(solver_.normal(r));
      any_short = any_short || ends_m_[r] < least_m_[r];
    }
  }
  if (any_short) solver_.part(due_, least_m_, moves_m_);
  for (const std::uint32_t r : due_.fixed) keep_out(r);
}

// A wall that turns is not where its velocity would take it.
template <class Real>
void LumpedContacts<Real>::keep_out(std::uint32_t r) {
  if (rows_[r].first.count != 1) return;
  const std::size_t slot = 4 * solver_.skin_slot(r);
  Eigen::Map<Vec3d> move_m(moves_m_.data() + slot);
  const auto end = solids_.end_gap(r - skin_rows_, Vec3d::Map(places_m_.data() + slot) + move_m);
  const double least_m = gaps_m_[r] + least_m_[r];
  if (end.gap_m < least_m) move_m += (least_m - end.gap_m) * end.normal;
}

template <class Real>
void LumpedContacts<Real>::store(const Substep& substep) {
  const ContactWorld<Real>& world = substep.world;
  const std::span<const LumpedSolver::Slot> slots = solver_.slots();
  for (std::size_t s = 0; s < slots.size(); ++s) {
    const auto [body, vertex] = slots[s];
    if (body >= world.soft.size() || world.soft[body].is_pinned(vertex)) continue;
    SoftState<Real>& state = world.soft[body];
    if (!state.is_awake() && (state.frozen || substep.soft_touched[body] == 0)) continue;
    state.v[vertex] = Vec3d::Map(velocities_m_s_.data() + 4 * s).template cast<Real>();
    state.dr[vertex] = Vec3d::Map(moves_m_.data() + 4 * s).template cast<Real>();
  }
  if (due_.rigid.empty()) return;
  for (std::size_t r = 0; r < world.rigid.size(); ++r) {
    if (!world.rigid[r].is_awake() && (world.rigid[r].frozen || substep.rigid_touched[r] == 0)) continue;
    world.rigid[r].velocity = solver_.rigid()[r].velocity;
    world.rigid[r].angular_velocity = solver_.rigid()[r].angular_velocity;
    world.rigid[r].position += solver_.rigid()[r].shift_m;
  }
}

template <class Real>
void LumpedContacts<Real>::add_moments(const Substep& substep, const SurfaceContacts<Real>& surfaces) {
  const ContactWorld<Real>& world = substep.world;
  for (const std::uint32_t r : due_.skins) {
    const ContactRow& row = rows_[r];
    const bool is_of_two =
        !surfaces.is_mesh(row.first.body) && !surfaces.is_mesh(row.second.body) && row.first.body != row.second.body;
    if (!is_of_two || solver_.impulses()[r].pressed_n_s == 0.0) continue;
    const Vec3d apart_m = solver_.value(r, places_m_);
    moments_.add(row.first.body, row.second.body, apart_m.cross(solver_.impulse_n_s(r)));
  }
  for (const std::uint32_t r : due_.rigid) {
    if (solver_.impulses()[r].pressed_n_s == 0.0) continue;
    const std::uint32_t rigid = solids_.index(r - skin_rows_);
    const Vec3d apart_m = solver_.at_skin(r, places_m_) - world.rigid[rigid].position - solver_.arm(r);
    moments_.add(rows_[r].first.body, world.soft.size() + rigid, apart_m.cross(solver_.impulse_n_s(r)));
  }
  for (const Hit& hit : hits_) {
    if (!solids_.is_rigid(hit.row - skin_rows_)) continue;
    const Support& of = rows_[hit.row].first;
    const SoftState<Real>& state = world.soft[of.body];
    if (state.is_pinned(of.vertices[0])) continue;
    const std::size_t slot = 4 * solver_.skin_slot(hit.row);
    const auto at = [slot](const LumpedSolver::Values& values) { return Vec3d(Vec3d::Map(values.data() + slot)); };
    const Vec3d turned = at(moves_m_).cross(at(velocities_m_s_)) - at(free_moves_m_).cross(at(velocities_before_m_s_));
    moments_.add(of.body, world.soft.size() + solids_.index(hit.row - skin_rows_),
                 state.mass_kg(of.vertices[0]) * turned);
  }
}

template <class Real>
void LumpedContacts<Real>::note(const Substep& substep, const SurfaceContacts<Real>& surfaces) const {
  for (const auto* list : {&due_.skins, &due_.rigid, &due_.fixed}) {
    for (const std::uint32_t r : *list) {
      if (solver_.impulses()[r].pressed_n_s > 0.0) note_row(substep, surfaces, r);
    }
  }
}

template <class Real>
void LumpedContacts<Real>::note_row(const Substep& substep, const SurfaceContacts<Real>& surfaces,
                                    std::uint32_t r) const {
  const ContactRow& row = rows_[r];
  const std::span<ContactNotes> notes = substep.world.notes;
  const auto append = [&](const Support& of, BodyRef other, const Vec3d& normal) {
    for (std::uint32_t i = 0; i < of.count && !notes.empty(); ++i) {
      notes[of.body].push_back({of.vertices[i], other, normal});
    }
  };
  const auto tally = [&](BodyRef first, BodyRef second, const Vec3d& position) {
    if (substep.world.touches == nullptr) return;
    substep.world.touches->add(first, second, solver_.impulse_n_s(r), position, solver_.normal(r));
  };
  if (is_of_solid(r)) {
    const bool is_rigid = solids_.is_rigid(r - skin_rows_);
    const std::uint32_t index = solids_.index(r - skin_rows_);
    substep.soft_touched[row.first.body] = 1;
    if (is_rigid) substep.rigid_touched[index] = 1;
    const BodyRef other{is_rigid ? BodyKind::rigid : BodyKind::collider, index};
    append(row.first, other, solver_.normal(r));
    tally({BodyKind::soft, row.first.body}, other, solver_.at_skin(r, places_m_));
    return;
  }
  const auto ref_of = [&](const Support& of) {
    const bool is_mesh = surfaces.is_mesh(of.body);
    return BodyRef{is_mesh ? BodyKind::collider : BodyKind::soft, is_mesh ? surfaces.mesh(of.body).index : of.body};
  };
  const auto append_other = [&](const Support& of, const Support& by, const Vec3d& normal) {
    if (surfaces.is_mesh(of.body)) return;
    substep.soft_touched[of.body] = 1;
    append(of, ref_of(by), normal);
  };
  append_other(row.first, row.second, row.normal);
  append_other(row.second, row.first, -row.normal);
  tally(ref_of(row.first), ref_of(row.second), mean_of(row.first, surfaces.bodies()[row.first.body].from));
}

template <class Real>
void LumpedContacts<Real>::cut(const Substep& substep, SurfaceContacts<Real>& surfaces) {
  // Whoever was woken has rows and pairs that were not looked for, and whoever was frozen has some that are not his.
  const bool is_as_begun = this->is_as_begun(substep.world);
  if (--substeps_left_ > 0 && is_as_begun) return;
  substeps_left_ = 0;
  const std::span<SoftState<Real>> soft = substep.world.soft;
  const auto load_ends = [&] {
    for (const std::uint32_t i : surfaces.loaded()) {
      SurfaceBody& body = surfaces.bodies()[i];
      const bool moves = soft[i].is_awake();
      for (std::size_t k = 0; k < body.to.size(); ++k) {
        body.to[k] = soft[i].position_m(k);
        if (moves) body.to[k] += soft[i].dr[k].template cast<double>();
      }
    }
  };
  load_ends();
  if (stop_missed(substep, surfaces)) load_ends();
  surfaces.update_crossing_candidates(soft, !is_as_begun);
  if (surfaces.pairs().empty()) return;
  surfaces.carry(soft.size());
  cut_moves(surfaces.pairs(), surfaces.bodies());
  for (const std::uint32_t i : surfaces.loaded()) {
    const SurfaceBody& body = surfaces.bodies()[i];
    for (std::uint32_t k = 0; k < body.cuts.size(); ++k) {
      if (body.cuts[k] >= 1.0 || soft[i].is_pinned(k) || !soft[i].is_awake()) continue;
      const Vec3d end = body.from[k] + body.cuts[k] * body.move_m(k);
      soft[i].dr[k] = (end - soft[i].position_m(k)).template cast<Real>();
      ++counts_.cut_vertices;
    }
  }
  for (std::size_t i = soft.size(); i < surfaces.bodies().size(); ++i) {
    std::ranges::fill(surfaces.bodies()[i].cuts, 1.0);
  }
}

template <class Real>
bool LumpedContacts<Real>::stop_missed(const Substep& substep, const SurfaceContacts<Real>& surfaces) {
  if (!has_solids(substep.world)) return false;
  const StageTimer timer(substep.world.substep.profile, Stage::solid_contact, substep.stage);
  return solids_.stop_missed(substep.world, surfaces.bodies(), surfaces.loaded());
}

template <class Real>
void LumpedContacts<Real>::clear() {
  rows_.clear();
  skin_rows_ = 0;
  solids_.clear();
}

template <class Real>
std::size_t LumpedContacts<Real>::bytes() const {
  std::size_t numbers = kept_m_.capacity();
  for (const auto* values : {&places_m_, &velocities_m_s_, &moves_m_, &velocities_before_m_s_, &free_moves_m_}) {
    numbers += values->capacity();
  }
  for (const auto* of_rows : {&gaps_m_, &opening_m_s_, &ends_m_, &least_m_}) numbers += of_rows->capacity();
  return numbers * sizeof(double) + rows_.capacity() * sizeof(ContactRow) + warm_.capacity() * sizeof(WarmImpulse) +
         (due_.skins.capacity() + due_.rigid.capacity() + due_.fixed.capacity()) * sizeof(std::uint32_t) +
         hits_.capacity() * sizeof(Hit) + wholes_.capacity() * sizeof(Whole) + solids_.bytes() + solver_.bytes() +
         turns_.bytes() + moments_.bytes();
}

template class LumpedContacts<float>;
template class LumpedContacts<double>;

}  // namespace pneuma::physics
