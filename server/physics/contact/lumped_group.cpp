#include "physics/contact/lumped_group.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/contact/solid_rows.h"
#include "physics/contact/surface_rows.h"
#include "physics/rigid/contact_surface.h"
#include "physics/rigid/rigid_mass.h"

namespace pneuma::physics {
namespace {

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

// A group with room for this many rows, and this many times what it had, frees it.
constexpr std::size_t large_rows = 256;
constexpr std::size_t idle_times = 8;

template <class Real>
BodyRef skin_of(const Support& of, const SurfaceContacts<Real>& surfaces) {
  if (!surfaces.is_mesh(of.body)) return {BodyKind::soft, of.body};
  return {BodyKind::collider, surfaces.mesh(of.body).index};
}

bool moves_by_velocity(Integrator integrator) {
  return integrator == Integrator::symplectic_euler || !is_explicit(integrator);
}

}  // namespace

template <class Real>
void LumpedGroup<Real>::clear() {
  // A heap's number is that of its lowest body, and may be another's in the next span. What is clear already says
  // nothing of what it had.
  const bool is_much = rows_.capacity() > large_rows && rows_.capacity() > idle_times * rows_.size();
  if (is_much && !rows_.empty()) *this = LumpedGroup();
  soft_.clear();
  rigid_.clear();
  rows_.clear();
  brief_.clear();
  skin_rows_ = 0;
  kept_m_.clear();
  solids_.clear();
}

template <class Real>
void LumpedGroup<Real>::add(ContactRow& row, const SurfaceContacts<Real>& surfaces) {
  const auto place_m = [&](const Support& of) { return mean_of(of, surfaces.bodies()[of.body].from); };
  rows_.push_back(&row);
  kept_m_.push_back((place_m(row.first) - place_m(row.second)).dot(row.normal) - row.gap_m);
  brief_.push_back({.near_m = row_slack_share * kept_m_.back(),
                    .restitution = row.restitution,
                    .first = skin_of(row.first, surfaces),
                    .second = skin_of(row.second, surfaces)});
  ++skin_rows_;
}

template <class Real>
void LumpedGroup<Real>::add(std::span<ContactRow> rows, const typename SpanSolids<Real>::Meeting& meeting,
                            const SpanSolid& solid, const SurfaceContacts<Real>& surfaces) {
  const SurfaceBody& surface = surfaces.bodies()[meeting.soft];
  for (ContactRow& row : rows) {
    rows_.push_back(&row);
    brief_.push_back({.near_m = solid_slack_share * surface.spacing_m,
                      .out_m = out_of_solid_share * surface.spacing_m,
                      .restitution = row.restitution,
                      .first = {BodyKind::soft, meeting.soft},
                      .second = {solid.is_rigid ? BodyKind::rigid : BodyKind::collider, solid.index},
                      .is_vertex_on_solid = row.first.count == 1});
  }
  solids_.add(solid, surface, meeting.border_m, rows);
}

template <class Real>
void LumpedGroup<Real>::begin(std::span<const WarmImpulse> warm, const SurfaceContacts<Real>& surfaces,
                              std::size_t rigid_count, std::span<const std::uint8_t> is_still, SlotTable& table) {
  for (ContactRow* row : rows_) {
    const auto before = std::ranges::lower_bound(warm, row->key, {}, &WarmImpulse::key);
    row->impulse_n_s = before != warm.end() && before->key == row->key ? before->impulse_n_s : Vec3d(Vec3d::Zero());
  }
  solver_.load(rows_, surfaces.bodies(), {rigid_, rigid_count, is_still}, table);
}

template <class Real>
RowCounts LumpedGroup<Real>::answer(const Substep& substep, const SurfaceContacts<Real>& surfaces,
                                    RowMoments& moments) {
  load_values(substep, surfaces);
  measure(substep);
  list_due(substep, surfaces);
  const bool converged = solve_velocities(substep);
  note(substep);
  add_moments(substep, surfaces, moments);
  solve_moves(substep);
  store(substep);
  return {.rows = rows_.size(), .unconverged = converged ? 0U : 1U, .cut_vertices = 0};
}

template <class Real>
void LumpedGroup<Real>::load_values(const Substep& substep, const SurfaceContacts<Real>& surfaces) {
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
  for (std::size_t r = 0; r < rigid_.size(); ++r) {
    const RigidState& state = world.rigid[rigid_[r]];
    solver_.rigid()[r] = {state.velocity, state.angular_velocity, Vec3d::Zero(), inverse_masses_1_kg(state),
                          inverse_inertia_1_kg_m2(state)};
  }
}

template <class Real>
void LumpedGroup<Real>::measure(const Substep& substep) {
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
void LumpedGroup<Real>::list_due(const Substep& substep, const SurfaceContacts<Real>& surfaces) {
  const double dt_s = substep.world.substep.dt_s;
  due_.clear();
  hits_.clear();
  wholes_.assign(soft_.size(), {});
  fastest_m_s_ = 0.0;
  for (std::uint32_t r = 0; r < rows_.size(); ++r) {
    LumpedImpulse& impulse = solver_.impulses()[r];
    const SubstepRow& brief = brief_[r];
    if (std::min(gaps_m_[r], ends_m_[r]) > brief.near_m && impulse.pressed_n_s == 0.0) continue;
    (!is_of_solid(r) ? due_.skins : solids_.is_rigid(r - skin_rows_) ? due_.rigid : due_.fixed).push_back(r);
    impulse.least_m_s = gaps_m_[r] > 0.0 ? -gaps_m_[r] / dt_s : carried_apart_m_s(substep, r).value_or(0.0);
    fastest_m_s_ = std::max(fastest_m_s_, std::abs(opening_m_s_[r]));
    if (ends_m_[r] >= 0.0 || opening_m_s_[r] >= 0.0) continue;
    const double share = gaps_m_[r] > 0.0 ? gaps_m_[r] / (gaps_m_[r] - ends_m_[r]) : 0.0;
    const double impact = impact_m_s(substep, surfaces, r, share);
    const bool hits_solid = brief.is_vertex_on_solid && solver_.gives_way(r);
    if (impact < 0.0 || hits_solid) impulse.least_m_s = -brief.restitution * impact;
    if (hits_solid) hits_.push_back({r, share});
  }
}

// How fast the row's two part, where the soft body is carried out of a solid. Nothing of other rows.
template <class Real>
std::optional<double> LumpedGroup<Real>::carried_apart_m_s(const Substep& substep, std::uint32_t r) const {
  const ContactWorld<Real>& world = substep.world;
  if (world.carried_m_s.empty() || !is_of_solid(r)) return {};
  const Vec3d soft_m_s = world.carried(rows_[r]->first.body);
  if (soft_m_s.isZero(0.0)) return {};
  const std::size_t solid = r - skin_rows_;
  const Vec3d solid_m_s =
      solids_.is_rigid(solid) ? world.carried(world.soft.size() + solids_.index(solid)) : Vec3d(Vec3d::Zero());
  return std::max(0.0, solver_.normal(r).dot(soft_m_s - solid_m_s));
}

// What restitution acts on: not on what gravity adds after the impact.
template <class Real>
double LumpedGroup<Real>::impact_m_s(const Substep& substep, const SurfaceContacts<Real>& surfaces, std::uint32_t r,
                                     double share) {
  if (!may_bounce(substep, surfaces, r)) return 0.0;
  const SubstepPhysics physics = substep.world.physics();
  const bool both_fall = is_of_solid(r) && solids_.is_rigid(r - skin_rows_);
  const double falls = both_fall ? 0.0 : brief_[r].first.kind == BodyKind::collider ? -1.0 : 1.0;
  const double gained_m_s = falls * (1.0 - share) * physics.dt_s * solver_.normal(r).dot(physics.gravity_m_s2);
  return impact_speed(opening_m_s_[r], gained_m_s, physics.resting_m_s);
}

// A vertex that hits a solid does, unless its own body presses it against it. Not one that hits another skin: what it
// would bounce off is a few grams, and the springs and the gas behind both give back what they took.
template <class Real>
bool LumpedGroup<Real>::may_bounce(const Substep& substep, const SurfaceContacts<Real>& surfaces, std::uint32_t r) {
  if (brief_[r].restitution == 0.0) return false;
  const ContactRow& row = *rows_[r];
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
auto LumpedGroup<Real>::whole_of(const Substep& substep, const SurfaceContacts<Real>& surfaces, std::uint32_t body)
    -> const Whole& {
  Whole& whole = wholes_[static_cast<std::size_t>(std::ranges::lower_bound(soft_, body) - soft_.begin())];
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
bool LumpedGroup<Real>::solve_velocities(const Substep& substep) {
  velocities_before_m_s_ = velocities_m_s_;
  if (!hits_.empty()) free_moves_m_ = moves_m_;
  solver_.push(velocities_m_s_);
  const SolveOutcome outcome =
      solver_.solve(due_, {.sweeps_max = sweeps_max, .enough_m_s = enough_share * fastest_m_s_}, velocities_m_s_);
  const double dt_s = substep.world.substep.dt_s;
  for (std::size_t i = 0; i < moves_m_.size(); ++i) {
    moves_m_[i] += dt_s * (velocities_m_s_[i] - velocities_before_m_s_[i]);
  }
  if (!moves_by_velocity(substep.world.substep.integrator)) move_skins_by_velocity(dt_s);
  take_back_pushes(substep.world.substep);
  slide_hits(dt_s);
  return outcome.converged;
}

// What the impulses hold at rest stays where it is. Moved by the mean of a substep's velocities, which a force still
// speeds up, it would go back against that force in each substep, and heaps would boil.
template <class Real>
void LumpedGroup<Real>::move_skins_by_velocity(double dt_s) {
  const auto move = [&](std::uint32_t r) {
    if (solver_.impulses()[r].pressed_n_s == 0.0) return;
    for (const std::uint32_t slot : solver_.pushed_slots(r)) {
      const std::size_t first = 4 * std::size_t{slot};
      Vec3d::Map(moves_m_.data() + first) = dt_s * Vec3d::Map(velocities_m_s_.data() + first);
    }
  };
  for (const std::uint32_t r : due_.skins) move(r);
  for_held(due_.rigid, [&](std::uint32_t r) {
    if (brief_[r].is_vertex_on_solid) move(r);
  });
}

// A row that only keeps a skin from going further into a solid says nothing of the move that the skin makes, where the
// method does not move by the velocity that a substep ends with. (Where it does, the moves are solved to the same.) Of
// a vertex and a rigid body it does: their angular momentum counts on it.
template <class Real>
void LumpedGroup<Real>::take_back_pushes(const SubstepContext& context) {
  const auto take_back = [&](std::uint32_t r) {
    if (solver_.impulses()[r].pressed_n_s > 0.0) solver_.take_back(r, context.dt_s, moves_m_);
  };
  for_held(due_.fixed, take_back);
  if (moves_by_velocity(context.integrator)) return;
  for_held(due_.rigid, [&](std::uint32_t r) {
    if (!brief_[r].is_vertex_on_solid) take_back(r);
  });
}

template <class Real>
template <class Visit>
void LumpedGroup<Real>::for_held(const std::vector<std::uint32_t>& of_solids, const Visit& visit) const {
  auto hit = hits_.begin();
  for (const std::uint32_t r : of_solids) {
    while (hit != hits_.end() && hit->row < r) ++hit;
    if (hit == hits_.end() || hit->row != r) visit(r);
  }
}

// What hits a solid goes there as it came, and for the rest of the substep slides along it: it parts in the next one.
template <class Real>
void LumpedGroup<Real>::slide_hits(double dt_s) {
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
void LumpedGroup<Real>::solve_moves(const Substep& substep) {
  const double dt_s = substep.world.substep.dt_s;
  const double back_share = std::min(1.0, dt_s / skin_overlap_time_s);
  solver_.project(moves_m_, rows_.size(), ends_m_);
  bool any_short = false;
  for (const auto* list : {&due_.skins, &due_.rigid, &due_.fixed}) {
    for (const std::uint32_t r : *list) {
      double back_m = -back_share * gaps_m_[r];
      if (brief_[r].is_vertex_on_solid) back_m = std::min(-gaps_m_[r], std::max(back_m, brief_[r].out_m));
      if (const auto carried_m_s = carried_apart_m_s(substep, r)) back_m = dt_s * *carried_m_s;
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
void LumpedGroup<Real>::keep_out(std::uint32_t r) {
  if (!brief_[r].is_vertex_on_solid) return;
  const std::size_t slot = 4 * solver_.skin_slot(r);
  Eigen::Map<Vec3d> move_m(moves_m_.data() + slot);
  const auto end = solids_.end_gap(r - skin_rows_, Vec3d::Map(places_m_.data() + slot) + move_m);
  const double least_m = gaps_m_[r] + least_m_[r];
  if (end.gap_m < least_m) move_m += (least_m - end.gap_m) * end.normal;
}

template <class Real>
void LumpedGroup<Real>::store(const Substep& substep) {
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
  for (std::size_t r = 0; r < rigid_.size(); ++r) {
    RigidState& state = world.rigid[rigid_[r]];
    if (!state.is_awake() && (state.frozen || substep.rigid_touched[rigid_[r]] == 0)) continue;
    state.velocity = solver_.rigid()[r].velocity;
    state.angular_velocity = solver_.rigid()[r].angular_velocity;
    state.position += solver_.rigid()[r].shift_m;
  }
}

template <class Real>
void LumpedGroup<Real>::add_moments(const Substep& substep, const SurfaceContacts<Real>& surfaces,
                                    RowMoments& moments) const {
  const ContactWorld<Real>& world = substep.world;
  for (const std::uint32_t r : due_.skins) {
    const ContactRow& row = *rows_[r];
    const bool is_of_two =
        !surfaces.is_mesh(row.first.body) && !surfaces.is_mesh(row.second.body) && row.first.body != row.second.body;
    if (!is_of_two || solver_.impulses()[r].pressed_n_s == 0.0) continue;
    const Vec3d apart_m = solver_.value(r, places_m_);
    moments.add(row.first.body, row.second.body, apart_m.cross(solver_.impulse_n_s(r)));
  }
  for (const std::uint32_t r : due_.rigid) {
    if (solver_.impulses()[r].pressed_n_s == 0.0) continue;
    const std::uint32_t rigid = solids_.index(r - skin_rows_);
    const Vec3d apart_m = solver_.at_skin(r, places_m_) - world.rigid[rigid].position - solver_.arm(r);
    moments.add(brief_[r].first.index, world.soft.size() + rigid, apart_m.cross(solver_.impulse_n_s(r)));
  }
  for (const Hit& hit : hits_) {
    if (!solids_.is_rigid(hit.row - skin_rows_)) continue;
    const Support& of = rows_[hit.row]->first;
    const SoftState<Real>& state = world.soft[of.body];
    if (state.is_pinned(of.vertices[0])) continue;
    const std::size_t slot = 4 * solver_.skin_slot(hit.row);
    const auto at = [slot](const LumpedSolver::Values& values) { return Vec3d(Vec3d::Map(values.data() + slot)); };
    const Vec3d turned = at(moves_m_).cross(at(velocities_m_s_)) - at(free_moves_m_).cross(at(velocities_before_m_s_));
    moments.add(of.body, world.soft.size() + solids_.index(hit.row - skin_rows_),
                state.mass_kg(of.vertices[0]) * turned);
  }
}

template <class Real>
template <class Visit>
void LumpedGroup<Real>::for_pressed(const Visit& visit) const {
  for (const auto* list : {&due_.skins, &due_.rigid, &due_.fixed}) {
    for (const std::uint32_t r : *list) {
      if (solver_.impulses()[r].pressed_n_s > 0.0) visit(r);
    }
  }
}

template <class Real>
void LumpedGroup<Real>::note(const Substep& substep) const {
  for_pressed([&](std::uint32_t r) {
    for (const BodyRef& of : {brief_[r].first, brief_[r].second}) {
      if (of.kind == BodyKind::soft) substep.soft_touched[of.index] = 1;
      if (of.kind == BodyKind::rigid) substep.rigid_touched[of.index] = 1;
    }
    if (!substep.world.notes.empty()) note_row(substep, r);
  });
}

template <class Real>
void LumpedGroup<Real>::note_row(const Substep& substep, std::uint32_t r) const {
  const auto note_one = [&](const Support& of, BodyRef who, BodyRef other, const Vec3d& normal) {
    if (who.kind != BodyKind::soft) return;
    for (std::uint32_t i = 0; i < of.count; ++i) {
      substep.world.notes[who.index].push_back({of.vertices[i], other, normal});
    }
  };
  const Vec3d normal = is_of_solid(r) ? solver_.normal(r) : rows_[r]->normal;
  const SubstepRow& brief = brief_[r];
  note_one(rows_[r]->first, brief.first, brief.second, normal);
  note_one(rows_[r]->second, brief.second, brief.first, -normal);
}

template <class Real>
void LumpedGroup<Real>::tally(const Substep& substep, const SurfaceContacts<Real>& surfaces) const {
  for_pressed([&](std::uint32_t r) {
    const Support& of = rows_[r]->first;
    const Vec3d position =
        is_of_solid(r) ? solver_.at_skin(r, places_m_) : mean_of(of, surfaces.bodies()[of.body].from);
    substep.world.touches->add(brief_[r].first, brief_[r].second, solver_.impulse_n_s(r), position, solver_.normal(r));
  });
}

template <class Real>
void LumpedGroup<Real>::append_impulses(std::vector<WarmImpulse>& warm) const {
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    if (solver_.impulses()[r].pressed_n_s > 0.0) warm.push_back({rows_[r]->key, solver_.impulse_n_s(r)});
  }
}

template <class Real>
std::size_t LumpedGroup<Real>::bytes() const {
  std::size_t numbers = kept_m_.capacity();
  for (const auto* values : {&places_m_, &velocities_m_s_, &moves_m_, &velocities_before_m_s_, &free_moves_m_}) {
    numbers += values->capacity();
  }
  for (const auto* of_rows : {&gaps_m_, &opening_m_s_, &ends_m_, &least_m_}) numbers += of_rows->capacity();
  std::size_t indices = soft_.capacity() + rigid_.capacity();
  for (const auto* list : {&due_.skins, &due_.rigid, &due_.fixed}) indices += list->capacity();
  return numbers * sizeof(double) + rows_.capacity() * sizeof(ContactRow*) + brief_.capacity() * sizeof(SubstepRow) +
         indices * sizeof(std::uint32_t) + hits_.capacity() * sizeof(Hit) + wholes_.capacity() * sizeof(Whole) +
         solids_.bytes() + solver_.bytes();
}

template class LumpedGroup<float>;
template class LumpedGroup<double>;

}  // namespace pneuma::physics
