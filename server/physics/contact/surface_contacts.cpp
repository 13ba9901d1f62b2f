#include "physics/contact/surface_contacts.h"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <utility>

#include "physics/contact/filter.h"
#include "physics/contact/surface_shell.h"
#include "physics/rigid/sweep.h"

namespace pneuma::physics {
namespace {

// What comes after answer() may change a move by this much before its candidates are found anew: of the body's moves,
// and of the shell.
constexpr double move_slack_share = 0.1;
constexpr double shell_slack_share = 0.5;
// What begins the substep nearer than the kept distance goes back to it within this time. At once, the springs would be
// fed.
constexpr double surface_overlap_time_s = 0.1;
// In which bodies that were put into each other move by the smaller one's length.
constexpr double parting_time_s = 0.3;
// The solve of velocities starts from the impulses of the substep before. Eight sweeps kept a heap of eight balls awake
// for 15 s in place of 17, and took a tenth longer.
constexpr std::uint32_t surface_sweeps_max = 5;
// Of the largest approach: what a sweep may change and be the last. Ten times as much leaves a tremble that keeps piles
// awake three times as long.
constexpr double surface_enough_share = 2e-3;
// Likewise of the way that is missing: what is left goes back in the next substep.
constexpr double place_enough_share = 0.05;

// Their mean, and the most beside it.
SurfaceDrift drift_of(std::span<const Vec3d> moves_m) {
  Vec3d sum = Vec3d::Zero();
  for (const Vec3d& move : moves_m) sum += move;
  const Vec3d mean = sum / static_cast<double>(moves_m.size());
  double furthest_m2 = 0.0;
  for (const Vec3d& move : moves_m) furthest_m2 = std::max(furthest_m2, (move - mean).squaredNorm());
  return {mean, std::sqrt(furthest_m2)};
}

Box grown(const Aabb<double>& box, double by_m) {
  return {box.min - Vec3d::Constant(by_m), box.max + Vec3d::Constant(by_m)};
}

bool holds_box(const Box& outer, const Box& inner) {
  return (inner.low.array() >= outer.low.array()).all() && (inner.high.array() <= outer.high.array()).all();
}

// What is within this needs a row.
double row_reach_m(const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  return (1.0 + row_slack_share) * kept_distance_m(pair, bodies);
}

template <class Value>
Vec3d relative(const ContactRow& row, const Value& value) {
  Vec3d sum = Vec3d::Zero();
  for (std::uint32_t i = 0; i < row.first.count; ++i) {
    sum += row.first.weights[i] * value(row.first.body, row.first.vertices[i]);
  }
  for (std::uint32_t i = 0; i < row.second.count; ++i) {
    sum -= row.second.weights[i] * value(row.second.body, row.second.vertices[i]);
  }
  return sum;
}

bool keeps_to_boxes(const SurfaceBody& body) {
  for (std::size_t i = 0; i < body.to.size(); ++i) {
    if (!((body.to[i] - body.boxed_to[i]).cwiseAbs().maxCoeff() <= body.slack_m)) return false;
  }
  return true;
}

}  // namespace

template <class Real>
std::shared_ptr<const SurfaceTopology> SurfaceContacts<Real>::topology_of(const std::shared_ptr<const Mesh>& mesh) {
  const auto known = std::ranges::find(topologies_, mesh, [](const auto& topology) { return topology->mesh; });
  if (known != topologies_.end()) return *known;
  topologies_.push_back(make_surface_topology(mesh));
  return topologies_.back();
}

template <class Real>
void SurfaceContacts<Real>::take_meshes(std::span<const ColliderState> colliders, double dt_s, double resting_m_s) {
  find_mesh_colliders(colliders, dt_s, meshes_);
  mesh_dt_s_ = dt_s;
  mesh_resting_m_s_ = resting_m_s;
}

template <class Real>
void SurfaceContacts<Real>::load_meshes(std::size_t soft_count) {
  meshes_begin_ = soft_count;
  bodies_.resize(soft_count + meshes_.size());
  for (std::size_t k = 0; k < meshes_.size(); ++k) {
    load_surface(meshes_[k], topology_of(meshes_[k].tree->mesh), bodies_[soft_count + k]);
  }
  may_carry_ = true;
}

template <class Real>
void SurfaceContacts<Real>::add_ways_out(std::vector<ContactRow>& rows) const {
  for (const auto& [first, second] : crossed_) {
    if (second >= meshes_begin_) find_ways_out(meshes_[second - meshes_begin_], first, second, bodies_, rows);
  }
}

template <class Real>
void SurfaceContacts<Real>::carry(std::size_t soft_count) {
  if (!std::exchange(may_carry_, false)) return;
  places_m_.resize(soft_count);
  const bool moves = std::ranges::any_of(meshes_, &MeshCollider::moves);
  for (std::size_t i = 0; moves && i < soft_count; ++i) places_m_[i] = bodies_[i].from;
  carry_with_meshes(pairs_, meshes_, soft_count, bodies_, carried_);
  for (std::size_t i = 0; moves && i < soft_count; ++i) {
    if (carried_[i] == 0) continue;
    moves_m_.resize(places_m_[i].size());
    for (std::size_t k = 0; k < moves_m_.size(); ++k) moves_m_[k] = bodies_[i].from[k] - places_m_[i][k];
    bodies_[i].drift += drift_of(moves_m_);
  }
}

// Of the vertices that hit a mesh, as they would any other collider; not those that their own body presses against it.
template <class Real>
double SurfaceContacts<Real>::bounce_m_s(std::span<const SoftState<Real>> soft, const ContactRow& row,
                                         double approach_m_s) {
  const bool hits = row.gap_m + mesh_dt_s_ * approach_m_s < 0.0;
  if (!hits || row.restitution == 0.0 || approach_m_s >= -mesh_resting_m_s_) return 0.0;
  const bool soft_first = row.first.body < meshes_begin_;
  const std::uint32_t body = soft_first ? row.first.body : row.second.body;
  const Support& on_mesh = soft_first ? row.second : row.first;
  if (!means_m_s_[body]) {
    Vec3d sum = Vec3d::Zero();
    for (const Vec3<Real>& velocity : soft[body].v) sum += velocity.template cast<double>();
    means_m_s_[body] = sum / static_cast<double>(soft[body].v.size());
  }
  Vec3d mean = *means_m_s_[body];
  for (std::uint32_t i = 0; i < on_mesh.count; ++i) {
    mean -= on_mesh.weights[i] / mesh_dt_s_ * bodies_[on_mesh.body].move_m(on_mesh.vertices[i]);
  }
  const double whole_m_s = (soft_first ? 1.0 : -1.0) * mean.dot(row.normal);
  return whole_m_s < -mesh_resting_m_s_ ? -row.restitution * approach_m_s : 0.0;
}

template <class Real>
void SurfaceContacts<Real>::load_tables(const SoftState<Real>& state, SurfaceBody& body) {
  const std::size_t count = state.x.size();
  body.topology = topology_of(state.body.mesh);
  body.surface = state.body.surface;
  body.spacing_m = spacing_m(state);
  body.shell_m = shell_m(state);
  for (std::size_t k = 0; k < count; ++k) {
    body.inverse_masses_1_kg.push_back(state.is_pinned(k) ? 0.0 : 1.0 / state.mass_kg(k));
  }
  for (auto* points : {&body.from, &body.to, &body.boxed_to}) points->assign(count, Vec3d::Zero());
  body.cuts.assign(count, 1.0);
}

// Where the bodies are and go, as boxes.
template <class Real>
void SurfaceContacts<Real>::load_ways(std::span<const SoftState<Real>> soft, std::span<const BodyBounds> bounds,
                                      bool all) {
  load_meshes(soft.size());
  loaded_.assign(soft.size(), 0);
  meeting_.clear();
  selves_.clear();
  seen_.clear();
  for (std::uint32_t i = 0; i < soft.size(); ++i) {
    const SoftState<Real>& state = soft[i];
    const bool meets_others = state.body.collision.soft == SoftCollision::exact;
    const bool is_seen = meets_others || state.body.collision.self || !meshes_.empty();
    if (!bounds[i].active || (!all && !is_seen)) continue;
    SurfaceBody& body = bodies_[i];
    if (!body.topology) load_tables(state, body);
    const double move_m =
        (bounds[i].swept.max - bounds[i].start.max).cwiseMax(bounds[i].start.min - bounds[i].swept.min).norm();
    body.slack_m = move_slack_share * move_m + shell_slack_share * body.shell_m;
    body.margin_m = (1.0 + row_slack_share) * body.shell_m + body.slack_m;
    body.at = grown(bounds[i].start, 0.0);
    body.way = grown(bounds[i].swept, body.margin_m);
    if (is_seen) seen_.push_back(i);
    if (meets_others) meeting_.push_back(i);
    if (state.body.collision.self && state.is_awake()) selves_.push_back(i);
  }
}

template <class Real>
void SurfaceContacts<Real>::load_vertices(const SoftState<Real>& state, SurfaceBody& body) {
  moves_m_.resize(state.x.size());
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const Vec3d at = state.origin_m + state.x[i].template cast<double>();
    moves_m_[i] = at - body.from[i];
    body.from[i] = at;
  }
  body.drift += drift_of(moves_m_);
  load_moves(state, body);
}

template <class Real>
void SurfaceContacts<Real>::load_moves(const SoftState<Real>& state, SurfaceBody& body) {
  moves_m_.resize(state.dr.size());
  for (std::size_t i = 0; i < state.dr.size(); ++i) {
    moves_m_[i] = state.dr[i].template cast<double>();
    body.to[i] = body.from[i] + moves_m_[i];
  }
  body.substep = drift_of(moves_m_);
}

// A pair that does not cross never will; so each is looked at when it first comes near, and while it is crossed.
template <class Real>
void SurfaceContacts<Real>::find_pairs(std::span<const SoftState<Real>> soft, bool watched) {
  near_.clear();
  for (const std::uint32_t i : selves_) near_.emplace_back(i, i);
  sort_and_sweep(
      meeting_, [&](std::uint32_t i) { return bodies_[i].way.low.x(); },
      [&](std::uint32_t i) { return bodies_[i].way.high.x(); },
      [&](std::uint32_t a, std::uint32_t b) {
        if (!soft[a].is_awake() && !soft[b].is_awake()) return;
        if (bodies_[a].way.overlaps(bodies_[b].way)) near_.emplace_back(std::min(a, b), std::max(a, b));
      });
  for (std::uint32_t k = 0; k < meshes_.size(); ++k) {
    const auto mesh = static_cast<std::uint32_t>(meshes_begin_ + k);
    for (const std::uint32_t i : seen_) {
      if (soft[i].is_awake() && bodies_[i].way.overlaps(bodies_[mesh].way)) near_.emplace_back(i, mesh);
    }
  }
  std::ranges::sort(near_);
  crossed_.clear();
  if (watched) keep_watches();
  std::size_t count = 0;
  std::size_t watch = 0;
  for (std::size_t at = 0; at < near_.size(); ++at) {
    const auto [first, second] = near_[at];
    if (pairs_.size() == count) pairs_.emplace_back();
    SurfacePair& pair = pairs_[count];
    pair.first = first;
    pair.second = second;
    for (const std::uint32_t i : {first, second}) {
      if (i >= meshes_begin_ || loaded_[i] != 0) continue;
      loaded_[i] = 1;
      load_vertices(soft[i], bodies_[i]);
      if (!watched || !meshes_.empty()) bodies_[i].boxed_to = bodies_[i].to;
    }
    if (first != second) {
      const std::pair key(first, second);
      const auto known = std::ranges::lower_bound(clear_, key);
      if (known == clear_.end() || *known != key) {
        if (finder_.are_crossed(pair, bodies_)) {
          crossed_.push_back(key);
          continue;
        }
        // A mesh that moves may run over a body between it and another one.
        if (second < meshes_begin_ || !meshes_[second - meshes_begin_].moves) clear_.insert(known, key);
      }
    }
    if (second >= meshes_begin_) {
      mesh_finder_.find(meshes_[second - meshes_begin_], pair, bodies_);
      measures_.measure(pair, bodies_);
      pair.drifted_m = 0.0;
    } else if (watched) {
      while (watches_[watch].bodies() != near_[at]) ++watch;
      const double slack_m = shell_slack_share * std::min(bodies_[first].shell_m, bodies_[second].shell_m);
      watches_[watch].look(row_reach_m(pair, bodies_) + slack_m, bodies_, finder_, measures_, pair);
    } else {
      finder_.find(pair, bodies_);
    }
    ++count;
  }
  pairs_.resize(count);
}

// Those of pairs that are near still, and new ones.
template <class Real>
void SurfaceContacts<Real>::keep_watches() {
  next_watches_.clear();
  std::size_t old = 0;
  for (const auto& key : near_) {
    if (key.second >= meshes_begin_) continue;
    while (old < watches_.size() && watches_[old].bodies() < key) ++old;
    if (old < watches_.size() && watches_[old].bodies() == key) {
      next_watches_.push_back(std::move(watches_[old]));
    } else {
      next_watches_.emplace_back(key.first, key.second);
    }
  }
  watches_.swap(next_watches_);
}

template <class Real>
void SurfaceContacts<Real>::find_rows(std::vector<ContactRow>& rows) {
  for (SurfacePair& pair : pairs_) measures_.measure(pair, bodies_);
  row_finder_.find(pairs_, bodies_, rows);
}

template <class Real>
bool SurfaceContacts<Real>::pairs_hold() {
  std::size_t watch = 0;
  return std::ranges::all_of(pairs_, [&](SurfacePair& pair) {
    if (pair.second >= meshes_begin_) return keeps_to_boxes(bodies_[pair.first]);
    while (watches_[watch].bodies() != std::pair(pair.first, pair.second)) ++watch;
    return watches_[watch].holds(row_reach_m(pair, bodies_), bodies_, pair);
  });
}

template <class Real>
void SurfaceContacts<Real>::answer(const Substep& substep, std::span<ContactNotes> notes,
                                   std::span<std::uint8_t> touched) {
  const std::span<SoftState<Real>> soft = substep.soft;
  const double dt_s = substep.dt_s;
  load_ways(soft, substep.bounds, false);
  find_pairs(soft, true);
  rows_.clear();
  row_finder_.find(pairs_, bodies_, rows_);
  add_ways_out(rows_);
  counts_.rows += rows_.size();
  if (rows_.empty()) {
    warm_.clear();
    return;
  }
  solver_.load(rows_, bodies_);
  solve_velocities(soft, dt_s, !substep.is_first);
  note(notes, touched);
  solver_.for_changes([&](std::uint32_t body, std::uint32_t vertex, const Vec3d& change_m_s) {
    if (body >= meshes_begin_ || change_m_s.isZero(0.0)) return;
    soft[body].v[vertex] += change_m_s.template cast<Real>();
    soft[body].dr[vertex] += (dt_s * change_m_s).template cast<Real>();
    SurfaceBody& surface = bodies_[body];
    surface.to[vertex] = surface.from[vertex] + soft[body].dr[vertex].template cast<double>();
  });
  solve_places(soft, dt_s);
}

// What is not there yet may come as near as its gap. Single vertices do not bounce, whatever the surfaces' restitution:
// what they would bounce off is a few grams of another skin, and the springs and the gas behind both give back what
// they took.
template <class Real>
void SurfaceContacts<Real>::solve_velocities(std::span<const SoftState<Real>> soft, double dt_s, bool warm) {
  double enough_m_s = 0.0;
  auto last = warm_.begin();
  means_m_s_.assign(meshes_.empty() ? 0 : meshes_begin_, std::nullopt);
  for (ContactRow& row : rows_) {
    row.free_m_s = relative(row, [&](std::uint32_t body, std::uint32_t vertex) -> Vec3d {
      if (body >= meshes_begin_) return bodies_[body].move_m(vertex) / dt_s;
      return soft[body].v[vertex].template cast<double>();
    });
    const double approach_m_s = row.free_m_s.dot(row.normal);
    row.least_m_s = -std::max(row.gap_m, 0.0) / dt_s;
    if (row.first.body >= meshes_begin_ || row.second.body >= meshes_begin_) {
      const double away_m_s = bounce_m_s(soft, row, approach_m_s);
      if (away_m_s > 0.0) row.least_m_s = away_m_s;
    }
    enough_m_s = std::max(enough_m_s, surface_enough_share * std::abs(approach_m_s));
    while (last != warm_.end() && last->key < row.key) ++last;
    if (warm && last != warm_.end() && last->key == row.key) row.impulse_n_s = last->impulse_n_s;
  }
  const SolveOutcome outcome = solver_.solve(rows_, {.sweeps_max = surface_sweeps_max, .enough_m_s = enough_m_s}, true);
  counts_.unconverged += outcome.converged ? 0 : 1;
  warm_.clear();
  for (const ContactRow& row : rows_) {
    if (!row.impulse_n_s.isZero(0.0)) warm_.push_back({row.key, row.impulse_n_s});
  }
}

// Moves alone: what is nearer than it should be goes back without a velocity, which would be energy.
template <class Real>
void SurfaceContacts<Real>::solve_places(std::span<SoftState<Real>> soft, double dt_s) {
  double shortest_m_s = 0.0;
  for (ContactRow& row : rows_) {
    row.free_m_s = relative(
        row, [&](std::uint32_t body, std::uint32_t vertex) -> Vec3d { return bodies_[body].move_m(vertex) / dt_s; });
    row.least_m_s = (row.gap_m > 0.0 ? -row.gap_m : -row.gap_m * std::min(1.0, dt_s / surface_overlap_time_s)) / dt_s;
    row.impulse_n_s.setZero();
    shortest_m_s = std::max(shortest_m_s, row.least_m_s - row.free_m_s.dot(row.normal));
  }
  if (shortest_m_s <= 0.0) return;
  (void)solver_.solve(rows_, {.sweeps_max = surface_sweeps_max, .enough_m_s = place_enough_share * shortest_m_s},
                      false);
  solver_.for_changes([&](std::uint32_t body, std::uint32_t vertex, const Vec3d& change_m_s) {
    if (body >= meshes_begin_ || change_m_s.isZero(0.0)) return;
    soft[body].dr[vertex] += (dt_s * change_m_s).template cast<Real>();
  });
}

template <class Real>
void SurfaceContacts<Real>::note(std::span<ContactNotes> notes, std::span<std::uint8_t> touched) const {
  for (const ContactRow& row : rows_) {
    if (!(row.impulse_n_s.dot(row.normal) > 0.0)) continue;
    for (const std::uint32_t body : {row.first.body, row.second.body}) {
      if (body < meshes_begin_) touched[body] = 1;
    }
    if (notes.empty()) continue;
    const auto append = [&](const Support& of, std::uint32_t other, const Vec3d& normal) {
      if (of.body >= meshes_begin_) return;
      const bool is_mesh = other >= meshes_begin_;
      const auto kind = is_mesh ? VertexContact::Other::collider : VertexContact::Other::soft;
      const std::uint32_t index = is_mesh ? meshes_[other - meshes_begin_].index : other;
      for (std::uint32_t i = 0; i < of.count; ++i) notes[of.body].push_back({of.vertices[i], kind, index, normal});
    };
    append(row.first, row.second.body, row.normal);
    append(row.second, row.first.body, -row.normal);
  }
}

template <class Real>
void SurfaceContacts<Real>::find_all(std::span<const SoftState<Real>> soft, std::span<const BodyBounds> bounds) {
  load_ways(soft, bounds, true);
  find_pairs(soft, false);
  for (std::uint32_t i = 0; i < soft.size(); ++i) {
    if (!bounds[i].active) continue;
    SurfaceBody& body = bodies_[i];
    std::ranges::fill(body.cuts, 1.0);
    if (loaded_[i] != 0) continue;
    load_vertices(soft[i], body);
    body.boxed_to = body.to;
  }
}

// The boxes hold all ways from where the substep found the vertices to near where they went then.
template <class Real>
void SurfaceContacts<Real>::update_candidates(std::span<const SoftState<Real>> soft) {
  const auto holds = [&](std::uint32_t i) { return keeps_to_boxes(bodies_[i]); };
  if (std::ranges::all_of(seen_, holds)) return;
  for (std::uint32_t i = 0; i < soft.size(); ++i) {
    SurfaceBody& body = bodies_[i];
    if (body.from.empty() || !(body.way.low.x() <= body.way.high.x())) continue;
    Box way = body.at;
    for (const Vec3d& at : body.from) way.include(at);
    for (const Vec3d& at : body.to) way.include(at);
    const Vec3d margin = Vec3d::Constant(body.margin_m);
    body.way = {way.low - margin, way.high + margin};
    body.boxed_to = body.to;
    loaded_[i] = 1;  // as they are now, not as the substep found them
  }
  find_pairs(soft, false);
}

// A body that was moved so may run through a third one now, so its pairs are looked at once more.
template <class Real>
void SurfaceContacts<Real>::part(std::span<SoftState<Real>> soft, double dt_s) {
  for (const auto& [first, second] : crossed_) {
    if (second >= meshes_begin_) continue;
    SoftState<Real>& a = soft[first];
    SoftState<Real>& b = soft[second];
    const auto inverse_mass_1_kg = [](const SoftState<Real>& state) {
      const bool is_held = std::ranges::any_of(std::views::iota(std::size_t{0}, state.x.size()),
                                               [&](std::size_t i) { return state.is_pinned(i); });
      return is_held || !state.is_awake() ? 0.0 : 1.0 / state.body.mass_kg;
    };
    const double of_a = inverse_mass_1_kg(a);
    const double of_b = inverse_mass_1_kg(b);
    if (of_a + of_b == 0.0) continue;
    const Vec3d way = finder_.way_apart({first, second}, bodies_);
    const double move_m = static_cast<double>(std::min(a.length_m, b.length_m)) * dt_s / parting_time_s;
    const double approach_m_s = std::max(0.0, way.dot(mean_velocity(b) - mean_velocity(a)));
    const auto push = [&](SoftState<Real>& state, double share) {
      const Vec3<Real> shift = (share * move_m * way).template cast<Real>();
      const Vec3<Real> change = (share * approach_m_s * way).template cast<Real>();
      if (share == 0.0) return;
      for (Vec3<Real>& x : state.x) x += shift;
      for (Vec3<Real>& v : state.v) v += change;
    };
    push(a, of_a / (of_a + of_b));
    push(b, -of_b / (of_a + of_b));
    std::erase_if(clear_, [&](const auto& pair) {
      return pair.first == first || pair.second == first || pair.first == second || pair.second == second;
    });
  }
}

template <class Real>
void SurfaceContacts<Real>::cut(const Substep& substep) {
  const std::span<SoftState<Real>> soft = substep.soft;
  bool holds = true;
  for (std::uint32_t i = 0; i < soft.size(); ++i) {
    SurfaceBody& body = bodies_[i];
    if (!body.topology || !substep.bounds[i].active) continue;
    holds = holds && holds_box(body.way, grown(substep.bounds[i].swept, (1.0 + row_slack_share) * body.shell_m));
    if (loaded_[i] == 0) continue;
    load_moves(soft[i], body);
  }
  if (!holds || !pairs_hold()) {
    load_ways(soft, substep.bounds, false);
    find_pairs(soft, true);
  }
  if (pairs_.empty()) return;
  carry(soft.size());
  (void)cut_moves(pairs_, bodies_);
  for (std::uint32_t i = 0; i < soft.size(); ++i) {
    if (loaded_[i] == 0) continue;
    for (std::size_t k = 0; k < bodies_[i].cuts.size(); ++k) {
      const double cut = std::exchange(bodies_[i].cuts[k], 1.0);
      if (cut >= 1.0 || soft[i].is_pinned(k)) continue;
      if (carried_[i] == 0) {
        soft[i].dr[k] *= static_cast<Real>(cut);
      } else {
        const Vec3d end = bodies_[i].from[k] + cut * bodies_[i].move_m(static_cast<std::uint32_t>(k));
        soft[i].dr[k] = (end - soft[i].position_m(k)).template cast<Real>();
      }
      ++counts_.cut_vertices;
    }
  }
  for (std::size_t i = meshes_begin_; i < bodies_.size(); ++i) std::ranges::fill(bodies_[i].cuts, 1.0);
}

template <class Real>
std::size_t SurfaceContacts<Real>::bytes() const {
  std::size_t sum = pairs_.capacity() * sizeof(SurfacePair) + rows_.capacity() * sizeof(ContactRow) +
                    warm_.capacity() * sizeof(WarmImpulse) + finder_.bytes() + mesh_finder_.bytes() +
                    measures_.bytes() + row_finder_.bytes() + solver_.bytes();
  for (const PairWatch& watch : watches_) sum += sizeof(PairWatch) + watch.bytes();
  for (const SurfacePair& pair : pairs_) sum += pair.candidates.capacity() * sizeof(Candidate);
  for (const SurfaceBody& body : bodies_) sum += body.bytes();
  for (const auto& topology : topologies_) sum += topology->bytes();
  return sum;
}

template class SurfaceContacts<float>;
template class SurfaceContacts<double>;

}  // namespace pneuma::physics
