#include "physics/contact/lumped_contacts.h"

#include <algorithm>
#include <functional>
#include <map>

#include "base/limits.h"
#include "physics/contact/cut_energy.h"
#include "physics/machine/profile.h"
#include "physics/machine/workers.h"

namespace pneuma::physics {
namespace {

// Rows hold while two bodies move by no more than this share of their vertices' spacing beside each other. Of five
// balls it makes two spans a tick, and the filter cuts a vertex in a hundred. Past 0.6 a heap of a hundred balls is no
// longer settled by its rows: each span leaves more to the filter than the one before.
constexpr double span_share = 0.5;
// Waking other threads takes some 10 us, in which one thread answers about half of these rows.
constexpr std::size_t parallel_rows_min = 150;
// Groups that are kept though a span has no use for them.
constexpr std::size_t idle_groups_max = 8;

// A span is stepped again where its cuts make more energy than lifts its bodies by a share of the distance that they
// keep, and a share of what they move by among themselves.
constexpr double cut_energy_share = 1e-3;
constexpr double cut_lift_share = 0.1;
// Its next try has this fraction of its substeps. Each span that goes well has twice as many as the one before.
constexpr std::uint32_t spans_again = 4;

template <class Real>
bool has_solids(const ContactWorld<Real>& world) {
  return !world.rigid.empty() || !world.colliders.empty();
}

}  // namespace

template <class Real>
bool LumpedContacts<Real>::begins_span(const SubstepContext& context) const {
  return substeps_left_ == 0 || context.is_first_of_tick;
}

template <class Real>
void LumpedContacts<Real>::keep_start(const SubstepContext& context, const Moving<Real>& moving) {
  is_asked_ = true;
  if (!begins_span(context)) return;
  if (context.is_first_of_tick && !is_taken_back_) substeps_max_ = context.substeps_left;
  start_.forget();
  if (std::min(substeps_max_, context.substeps_left) > 1) start_.keep(moving, context.substeps_left);
}

template <class Real>
std::uint32_t LumpedContacts<Real>::take_back(const Moving<Real>& moving) {
  if (!std::exchange(is_to_be_taken_back_, false) || !start_.can_restore(moving)) return 0;
  start_.restore(moving);
  moments_ = moments_before_;
  substeps_left_ = 0;
  substeps_max_ = std::max(1U, span_substeps_ / spans_again);
  is_taken_back_ = true;
  return start_.substeps_left();
}

template <class Real>
void LumpedContacts<Real>::answer(const Substep& substep, SurfaceContacts<Real>& surfaces) {
  const SubstepContext& context = substep.world.substep;
  moments_.begin(substep.world.soft.size() + substep.world.rigid.size(), context.is_first_of_tick);
  const bool may_be_taken_back = std::exchange(is_asked_, false);
  if (!may_be_taken_back) start_.forget();
  if (begins_span(context)) begin_span(substep, surfaces, may_be_taken_back ? substeps_max_ : context.substeps_left);
  answer_groups(substep, surfaces);
  if (context.is_last_of_tick()) moments_.turn_back(substep.world.soft, substep.world.rigid);
}

template <class Real>
void LumpedContacts<Real>::begin_span(const Substep& substep, SurfaceContacts<Real>& surfaces,
                                      std::uint32_t substeps_max) {
  using Whose = typename SurfaceContacts<Real>::Whose;
  const ContactWorld<Real>& world = substep.world;
  const Whose whose = has_solids(world) ? Whose::all : Whose::of_those_that_meet;
  const bool is_again = std::exchange(is_taken_back_, false);
  moments_before_ = moments_;
  substeps_left_ = std::min(world.substep.substeps_left, substeps_max);
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
  span_substeps_ = substeps_left_;
  if (!is_again) keep_impulses(!world.substep.is_first_of_tick);
  surfaces.find_pairs(world.soft);
  find_rows(substep, surfaces);
  join_bodies(world, surfaces);
  number_groups(static_cast<std::uint32_t>(world.soft.size()));
  deal_rows(world.rigid.size(), surfaces);
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
void LumpedContacts<Real>::keep_impulses(bool of_this_tick) {
  warm_.clear();
  for (std::size_t g = 0; of_this_tick && g < group_count_; ++g) groups_[g].append_impulses(warm_);
  std::ranges::sort(warm_, {}, &WarmImpulse::key);
}

template <class Real>
void LumpedContacts<Real>::find_rows(const Substep& substep, SurfaceContacts<Real>& surfaces) {
  rows_.clear();
  surfaces.find_rows(substep.world.soft, rows_);
  surfaces.add_ways_out(rows_);
  turns_.sort(rows_, surfaces.bodies());
  skin_rows_ = rows_.size();
  solids_.clear();
  if (!has_solids(substep.world)) return;
  const StageTimer timer(substep.world.substep.profile, Stage::solid_contact, substep.stage);
  solids_.find_rows(substep.world, surfaces.bodies(), surfaces.loaded(),
                    static_cast<std::uint32_t>(surfaces.bodies().size()), substeps_left_, rows_);
}

// Colliders join nothing, since they do not give way.
template <class Real>
void LumpedContacts<Real>::join_bodies(const ContactWorld<Real>& world, const SurfaceContacts<Real>& surfaces) {
  const auto soft_count = static_cast<std::uint32_t>(world.soft.size());
  joined_.begin(soft_count + world.rigid.size());
  group_of_.assign(soft_count + world.rigid.size(), no_group);
  for (const ContactRow& row : std::span(rows_).first(skin_rows_)) {
    const bool first_moves = !surfaces.is_mesh(row.first.body);
    const bool second_moves = !surfaces.is_mesh(row.second.body);
    if (first_moves) group_of_[row.first.body] = unnumbered;
    if (second_moves) group_of_[row.second.body] = unnumbered;
    if (first_moves && second_moves) joined_.join(row.first.body, row.second.body);
  }
  for (const auto& meeting : solids_.meetings()) {
    group_of_[meeting.soft] = unnumbered;
    const SpanSolid& solid = solids_.solid(meeting.solid);
    if (!solid.is_rigid) continue;
    group_of_[soft_count + solid.index] = unnumbered;
    joined_.join(meeting.soft, soft_count + solid.index);
  }
}

template <class Real>
void LumpedContacts<Real>::number_groups(std::uint32_t soft_count) {
  group_count_ = 0;
  for (std::uint32_t i = 0; i < group_of_.size(); ++i) {
    if (group_of_[i] == no_group) continue;
    const std::uint32_t lowest = joined_.lowest_with(i);
    if (lowest == i) {
      group_of_[i] = static_cast<std::uint32_t>(group_count_++);
      if (groups_.size() < group_count_) groups_.emplace_back();
      groups_[group_of_[i]].clear();
    } else {
      group_of_[i] = group_of_[lowest];
    }
    LumpedGroup<Real>& group = groups_[group_of_[i]];
    if (i < soft_count) {
      group.add_soft(i);
    } else {
      group.add_rigid(i - soft_count);
    }
  }
  groups_.resize(std::min(groups_.size(), group_count_ + idle_groups_max));
}

template <class Real>
void LumpedContacts<Real>::deal_rows(std::size_t rigid_count, const SurfaceContacts<Real>& surfaces) {
  const std::span<ContactRow> rows = rows_;
  for (ContactRow& row : rows.first(skin_rows_)) {
    const Support& of = surfaces.is_mesh(row.first.body) ? row.second : row.first;
    groups_[group_of_[of.body]].add(row, surfaces);
  }
  for (const auto& meeting : solids_.meetings()) {
    groups_[group_of_[meeting.soft]].add(rows.subspan(meeting.first_row, meeting.row_count), meeting,
                                         solids_.solid(meeting.solid), surfaces);
  }
  slots_.begin(surfaces.bodies());
  most_rows_ = 0;
  for (std::size_t g = 0; g < group_count_; ++g) {
    groups_[g].begin(warm_, surfaces, rigid_count, solids_.is_still(), slots_);
    most_rows_ = std::max(most_rows_, groups_[g].row_count());
  }
}

// On several threads no clock tells solids from surfaces: their stage has the time of both.
template <class Real>
void LumpedContacts<Real>::answer_groups(const Substep& substep, const SurfaceContacts<Real>& surfaces) {
  counts_of_groups_.resize(group_count_);
  ContactWorld<Real> world = substep.world;
  const Substep own{world, substep.bounds, substep.soft_touched, substep.rigid_touched, substep.stage};
  const auto answer_one = [&](std::size_t g) { counts_of_groups_[g] = groups_[g].answer(own, surfaces, moments_); };
  Workers* workers = world.substep.workers;
  if (workers != nullptr && workers->threads() > 1 && rows_.size() - most_rows_ >= parallel_rows_min) {
    world.substep = world.substep.of_body(nullptr, nullptr);
    workers->for_each(group_count_, std::cref(answer_one));
  } else {
    for (std::size_t g = 0; g < group_count_; ++g) answer_one(g);
  }
  for (const RowCounts& counts : counts_of_groups_) counts_ = counts_ + counts;
  if (substep.world.touches == nullptr) return;
  for (std::size_t g = 0; g < group_count_; ++g) groups_[g].tally(substep, surfaces);
}

template <class Real>
void LumpedContacts<Real>::cut(const Substep& substep, SurfaceContacts<Real>& surfaces) {
  // Whoever was woken has rows and pairs that were not looked for, and whoever was frozen has some that are not his.
  const bool is_as_begun = this->is_as_begun(substep.world);
  if (--substeps_left_ > 0 && is_as_begun) return;
  substeps_left_ = 0;
  const std::span<SoftState<Real>> soft = substep.world.soft;
  load_ends(soft, surfaces);
  mark_free(soft, surfaces);
  free_ends_m_.clear();
  if (stop_missed(substep, surfaces)) {
    free_ends_m_.resize(soft.size());
    for (const std::uint32_t i : surfaces.loaded()) free_ends_m_[i] = surfaces.bodies()[i].to;
    load_ends(soft, surfaces);
  }
  StoppedFeatures stopped;
  surfaces.update_crossing_candidates(soft, !is_as_begun);
  if (!surfaces.pairs().empty()) {
    surfaces.carry(soft.size());
    stopped = surfaces.filter(soft);
  }
  for (const StoppedFeatures::Vertex& of : stopped.vertices()) {
    if (of.body >= soft.size() || soft[of.body].is_pinned(of.vertex) || !soft[of.body].is_awake()) continue;
    const SurfaceBody& body = surfaces.bodies()[of.body];
    const Vec3d end = body.from[of.vertex] + body.cut_move_m(of.vertex);
    soft[of.body].dr[of.vertex] = (end - soft[of.body].position_m(of.vertex)).template cast<Real>();
    ++counts_.cut_vertices;
  }
  is_to_be_taken_back_ =
      start_.substeps_left() > 0 && span_substeps_ > 1 && is_as_begun && is_cut_short(substep, surfaces, stopped);
  if (span_substeps_ == 1) stop_cut(substep, surfaces, stopped);
  substeps_max_ = std::min(2 * substeps_max_, base::substeps_max);
  for (std::size_t i = soft.size(); i < surfaces.bodies().size(); ++i) {
    std::ranges::fill(surfaces.bodies()[i].cuts, 1.0);
  }
}

// Where the bodies would go now. A free vertex that goes elsewhere than when it was loaded before was stopped by a
// solid.
template <class Real>
void LumpedContacts<Real>::load_ends(std::span<const SoftState<Real>> soft, SurfaceContacts<Real>& surfaces) const {
  for (const std::uint32_t i : surfaces.loaded()) {
    SurfaceBody& body = surfaces.bodies()[i];
    const bool moves = soft[i].is_awake();
    for (std::size_t k = 0; k < body.to.size(); ++k) {
      Vec3d end_m = soft[i].position_m(k);
      if (moves) end_m += soft[i].dr[k].template cast<double>();
      if (!body.free.empty() && end_m != body.to[k]) body.free[k] = 0;
      body.to[k] = end_m;
    }
  }
}

template <class Real>
void LumpedContacts<Real>::mark_free(std::span<const SoftState<Real>> soft, SurfaceContacts<Real>& surfaces) const {
  for (const std::uint32_t i : surfaces.loaded()) physics::mark_free(soft[i], surfaces.bodies()[i]);
  for (const ContactRow& row : std::span(rows_).subspan(skin_rows_)) {
    for (std::uint32_t k = 0; k < row.first.count; ++k) {
      surfaces.bodies()[row.first.body].free[row.first.vertices[k]] = 0;
    }
  }
}

// Whether the cuts of any group give more energy than may be overlooked.
template <class Real>
bool LumpedContacts<Real>::is_cut_short(const Substep& substep, const SurfaceContacts<Real>& surfaces,
                                        const StoppedFeatures& stopped) const {
  struct Group {
    std::vector<std::uint32_t> bodies;
    double made_j = 0.0;
    double lifted_j = 0.0;
  };
  std::map<std::uint32_t, Group> groups;
  const std::span<const SoftState<Real>> soft = substep.world.soft;
  const std::span<const StoppedFeatures::Vertex> vertices = stopped.vertices();
  auto next = vertices.begin();
  std::vector<Vec3d> missed_m;
  for (const std::uint32_t i : surfaces.loaded()) {
    const auto begin = std::find_if(next, vertices.end(), [i](const auto& of) { return of.body >= i; });
    next = std::find_if(begin, vertices.end(), [i](const auto& of) { return of.body > i; });
    const SurfaceBody& body = surfaces.bodies()[i];
    const bool is_stopped = begin != next || (!free_ends_m_.empty() && free_ends_m_[i] != body.to);
    if (!is_stopped || !soft[i].is_awake()) continue;
    missed_m.assign(body.to.size(), Vec3d::Zero());
    for (std::size_t k = 0; !free_ends_m_.empty() && k < missed_m.size(); ++k)
      missed_m[k] = free_ends_m_[i][k] - body.to[k];
    for (auto of = begin; of != next; ++of) {
      if (!soft[i].is_pinned(of->vertex)) missed_m[of->vertex] += of->missed_m;
    }
    Group& group = groups[group_of_[i]];
    group.bodies.push_back(i);
    group.made_j += stretched_by_cuts_j(soft[i], body, missed_m);
    group.lifted_j +=
        cut_lift_share * body.shell_m * soft[i].body.mass_kg * substep.world.physics().gravity_m_s2.norm();
  }
  return std::ranges::any_of(groups, [&](const auto& each) {
    const Group& group = each.second;
    return group.made_j > group.lifted_j &&
           group.made_j > group.lifted_j + cut_energy_share * kinetic_among_j(soft, std::span(group.bodies));
  });
}

// In a longer span rows have answered since then. What turned back already is not stopped once more.
template <class Real>
void LumpedContacts<Real>::stop_cut(const Substep& substep, const SurfaceContacts<Real>& surfaces,
                                    StoppedFeatures& stopped) const {
  const std::span<SoftState<Real>> soft = substep.world.soft;
  for (StoppedFeatures::Vertex& of : stopped.vertices()) {
    if (of.body >= soft.size()) {
      of.is_held = true;
      of.velocity_m_s = surfaces.mesh_move_m(of.body, of.vertex) / substep.world.substep.dt_s;
      continue;
    }
    of.is_held = !soft[of.body].is_awake() || soft[of.body].is_pinned(of.vertex);
    if (of.is_held) continue;
    of.velocity_m_s = soft[of.body].v[of.vertex].template cast<double>();
    if (of.velocity_m_s.dot(of.missed_m) < 0.0) continue;
    of.mass_kg = soft[of.body].mass_kg(of.vertex);
  }
  stopped.stop();
  for (const StoppedFeatures::Vertex& of : stopped.vertices()) {
    if (of.mass_kg > 0.0) soft[of.body].v[of.vertex] = of.velocity_m_s.template cast<Real>();
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
  for (LumpedGroup<Real>& group : groups_) group.clear();
  group_count_ = 0;
  solids_.clear();
  start_.forget();
  is_asked_ = is_taken_back_ = is_to_be_taken_back_ = false;
}

template <class Real>
std::size_t LumpedContacts<Real>::bytes() const {
  std::size_t of_groups = groups_.capacity() * sizeof(LumpedGroup<Real>);
  for (const LumpedGroup<Real>& group : groups_) of_groups += group.bytes();
  std::size_t ends = free_ends_m_.capacity() * sizeof(free_ends_m_[0]);
  for (const auto& of_body : free_ends_m_) ends += of_body.capacity() * sizeof(Vec3d);
  return of_groups + start_.bytes() + awake_.capacity() + rows_.capacity() * sizeof(ContactRow) + solids_.bytes() +
         turns_.bytes() + joined_.bytes() + group_of_.capacity() * sizeof(std::uint32_t) +
         counts_of_groups_.capacity() * sizeof(RowCounts) + slots_.bytes() + warm_.capacity() * sizeof(WarmImpulse) +
         moments_.bytes() + moments_before_.bytes() + ends;
}

template class LumpedContacts<float>;
template class LumpedContacts<double>;

}  // namespace pneuma::physics
