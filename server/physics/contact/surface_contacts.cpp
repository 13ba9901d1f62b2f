#include "physics/contact/surface_contacts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/contact/filter.h"
#include "physics/contact/surface_rows.h"
#include "physics/contact/surface_shell.h"
#include "physics/rigid/sweep.h"

namespace pneuma::physics {
namespace {

// What comes after answer() may change a move by this much before its candidates are found anew: of the body's largest
// move, and of the shell.
constexpr double move_slack_share = 0.1;
constexpr double shell_slack_share = 0.5;
// What begins the substep nearer than the kept distance goes back to it within this time. At once, the springs would be
// fed.
constexpr double surface_overlap_time_s = 0.1;
constexpr std::uint32_t surface_sweeps_max = 12;
// Of the largest approach: what a sweep may change and be the last.
constexpr double surface_enough_share = 1e-2;
// Minima and maxima by lanes: two points are six numbers, which a compiler keeps in vector registers.
template <class Real>
Box box_of(const std::vector<Vec3<Real>>& points) {
  constexpr std::size_t lanes = 6;
  std::array<Real, lanes> low;
  std::array<Real, lanes> high;
  const Real* values = points.front().data();
  const std::size_t count = 3 * points.size();
  for (std::size_t k = 0; k < lanes; ++k) low[k] = high[k] = values[k % 3];
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    for (std::size_t k = 0; k < lanes; ++k) {
      low[k] = values[i + k] < low[k] ? values[i + k] : low[k];
      high[k] = values[i + k] > high[k] ? values[i + k] : high[k];
    }
  }
  for (std::size_t k = 0; i + k < count; ++k) {
    low[k] = std::min(low[k], values[i + k]);
    high[k] = std::max(high[k], values[i + k]);
  }
  Box box;
  for (std::size_t k = 0; k < lanes; ++k) {
    const auto axis = static_cast<Eigen::Index>(k % 3);
    box.low[axis] = std::min(box.low[axis], static_cast<double>(low[k]));
    box.high[axis] = std::max(box.high[axis], static_cast<double>(high[k]));
  }
  return box;
}

bool keeps_to_boxes(const SurfaceBody& body) {
  for (std::size_t i = 0; i < body.to.size(); ++i) {
    if (!((body.to[i] - body.boxed_to[i]).cwiseAbs().maxCoeff() <= body.slack_m)) return false;
  }
  return true;
}

}  // namespace

template <class Real>
bool SurfaceContacts<Real>::meets(std::uint32_t a, std::uint32_t b) const {
  return !std::ranges::binary_search(crossed_, std::pair(std::min(a, b), std::max(a, b)));
}

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
void SurfaceContacts<Real>::load_meshes(std::size_t soft_count, double dt_s) {
  meshes_begin_ = soft_count;
  bodies_.resize(soft_count + meshes_.size());
  for (std::size_t k = 0; k < meshes_.size(); ++k) {
    load_surface(meshes_[k], topology_of(meshes_[k].tree->mesh), dt_s, bodies_[soft_count + k]);
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
  carry_with_meshes(pairs_, meshes_, soft_count, bodies_, carried_);
}

// Of the vertices that hit a mesh, as they would any other collider; not those that their own body presses against it.
template <class Real>
double SurfaceContacts<Real>::bounce_m_s(const ContactRow& row, double approach_m_s) {
  const bool hits = row.gap_m + mesh_dt_s_ * approach_m_s < 0.0;
  if (!hits || row.restitution == 0.0 || approach_m_s >= -mesh_resting_m_s_) return 0.0;
  const bool soft_first = row.first.body < meshes_begin_;
  const std::uint32_t soft = soft_first ? row.first.body : row.second.body;
  const Support& on_mesh = soft_first ? row.second : row.first;
  if (!means_m_s_[soft]) {
    means_m_s_[soft] = Vec3d::Zero();
    for (const Vec3d& velocity : bodies_[soft].velocities_m_s) *means_m_s_[soft] += velocity;
    *means_m_s_[soft] /= static_cast<double>(bodies_[soft].velocities_m_s.size());
  }
  Vec3d mean = *means_m_s_[soft];
  for (std::uint32_t i = 0; i < on_mesh.count; ++i) {
    mean -= on_mesh.weights[i] * bodies_[on_mesh.body].velocities_m_s[on_mesh.vertices[i]];
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
  for (auto* points : {&body.from, &body.to, &body.boxed_to, &body.velocities_m_s, &body.changes_m_s}) {
    points->assign(count, Vec3d::Zero());
  }
  body.cuts.assign(count, 1.0);
}

// Where the bodies are and go, as boxes.
template <class Real>
void SurfaceContacts<Real>::load_ways(std::span<const SoftState<Real>> soft, std::span<const std::uint8_t> active,
                                      bool all) {
  load_meshes(soft.size(), mesh_dt_s_);
  start_boxes_.resize(soft.size());
  loaded_.assign(soft.size(), 0);
  meeting_.clear();
  selves_.clear();
  seen_.clear();
  for (std::uint32_t i = 0; i < soft.size(); ++i) {
    const SoftState<Real>& state = soft[i];
    const bool meets_others = state.body.collision.soft == SoftCollision::exact;
    const bool is_seen = meets_others || state.body.collision.self || !meshes_.empty();
    if (active[i] == 0 || (!all && !is_seen)) continue;
    SurfaceBody& body = bodies_[i];
    if (!body.topology) load_tables(state, body);
    const Box start = box_of(state.x);
    const Box moves = box_of(state.dr);
    start_boxes_[i] = {state.origin_m + start.low, state.origin_m + start.high};
    body.slack_m = move_slack_share * moves.low.cwiseAbs().cwiseMax(moves.high.cwiseAbs()).norm() +
                   shell_slack_share * body.shell_m;
    body.margin_m = (1.0 + row_slack_share) * body.shell_m + body.slack_m;
    const Vec3d margin = Vec3d::Constant(body.margin_m);
    body.way = {start_boxes_[i].low + moves.low.cwiseMin(0.0) - margin,
                start_boxes_[i].high + moves.high.cwiseMax(0.0) + margin};
    if (is_seen) seen_.push_back(i);
    if (meets_others) meeting_.push_back(i);
    if (state.body.collision.self && state.is_awake()) selves_.push_back(i);
  }
}

// A pair that does not cross never will; so each is looked at when it first comes near, and while it is crossed.
template <class Real>
void SurfaceContacts<Real>::find_pairs(std::span<const SoftState<Real>> soft) {
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
  paired_.clear();
  std::size_t count = 0;
  for (const auto& [first, second] : near_) {
    if (pairs_.size() == count) pairs_.emplace_back();
    SurfacePair& pair = pairs_[count];
    pair.first = first;
    pair.second = second;
    for (const std::uint32_t i : {first, second}) {
      if (i >= meshes_begin_ || loaded_[i] != 0) continue;
      loaded_[i] = 1;
      paired_.push_back(i);
      SurfaceBody& body = bodies_[i];
      for (std::size_t k = 0; k < body.from.size(); ++k) {
        body.from[k] = soft[i].position_m(k);
        body.to[k] = body.from[k] + soft[i].dr[k].template cast<double>();
      }
      body.boxed_to = body.to;
    }
    if (first != second) {
      const std::pair key(first, second);
      const auto known = std::ranges::lower_bound(clear_, key);
      if (known == clear_.end() || *known != key) {
        if (finder_.are_crossed(pair, bodies_)) {
          crossed_.push_back(key);
          continue;
        }
        clear_.insert(known, key);
      }
    }
    if (second >= meshes_begin_) {
      mesh_finder_.find(meshes_[second - meshes_begin_], pair, bodies_);
    } else {
      finder_.find(pair, bodies_);
    }
    ++count;
  }
  pairs_.resize(count);
}

template <class Real>
template <class Visit>
void SurfaceContacts<Real>::for_paired_vertices(const Visit& visit) {
  for (const std::uint32_t i : paired_) {
    for (std::uint32_t k = 0; k < bodies_[i].from.size(); ++k) visit(i, k);
  }
}

template <class Real>
void SurfaceContacts<Real>::answer(std::span<SoftState<Real>> soft, std::span<const std::uint8_t> active, double dt_s,
                                   std::span<ContactNotes> notes, std::span<std::uint8_t> touched) {
  load_ways(soft, active, false);
  find_pairs(soft);
  rows_.clear();
  find_surface_rows(pairs_, bodies_, rows_);
  add_ways_out(rows_);
  counts_.rows += rows_.size();
  if (rows_.empty()) return;
  for_paired_vertices([&](std::uint32_t body, std::uint32_t vertex) {
    bodies_[body].velocities_m_s[vertex] = soft[body].v[vertex].template cast<double>();
  });
  responses_.clear();
  for (SurfaceBody& body : bodies_) responses_.emplace_back(LumpedResponse(body.inverse_masses_1_kg, body.changes_m_s));
  solve_velocities(dt_s);
  note(notes, touched);
  for_paired_vertices([&](std::uint32_t body, std::uint32_t vertex) {
    SurfaceBody& surface = bodies_[body];
    const Vec3d change_m_s = surface.changes_m_s[vertex];
    if (change_m_s.isZero(0.0)) return;
    surface.changes_m_s[vertex].setZero();
    soft[body].v[vertex] += change_m_s.template cast<Real>();
    soft[body].dr[vertex] += (dt_s * change_m_s).template cast<Real>();
    surface.to[vertex] = surface.from[vertex] + soft[body].dr[vertex].template cast<double>();
  });
  solve_places(dt_s);
  for_paired_vertices([&](std::uint32_t body, std::uint32_t vertex) {
    const Vec3d change_m_s = bodies_[body].changes_m_s[vertex];
    if (change_m_s.isZero(0.0)) return;
    bodies_[body].changes_m_s[vertex].setZero();
    soft[body].dr[vertex] += (dt_s * change_m_s).template cast<Real>();
  });
}

namespace {

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

}  // namespace

// What is not there yet may come as near as its gap. Single vertices do not bounce, whatever the surfaces' restitution:
// what they would bounce off is a few grams of another skin, and the springs and the gas behind both give back what
// they took.
template <class Real>
void SurfaceContacts<Real>::solve_velocities(double dt_s) {
  double enough_m_s = 0.0;
  means_m_s_.assign(meshes_.empty() ? 0 : meshes_begin_, std::nullopt);
  for (ContactRow& row : rows_) {
    row.free_m_s = relative(
        row, [&](std::uint32_t body, std::uint32_t vertex) -> Vec3d { return bodies_[body].velocities_m_s[vertex]; });
    const double approach_m_s = row.free_m_s.dot(row.normal);
    row.least_m_s = -std::max(row.gap_m, 0.0) / dt_s;
    if (row.first.body >= meshes_begin_ || row.second.body >= meshes_begin_) {
      const double away_m_s = bounce_m_s(row, approach_m_s);
      if (away_m_s > 0.0) row.least_m_s = away_m_s;
    }
    enough_m_s = std::max(enough_m_s, surface_enough_share * std::abs(approach_m_s));
  }
  const SolveOutcome outcome =
      solve_rows(rows_, responses_, {.sweeps_max = surface_sweeps_max, .enough_m_s = enough_m_s});
  counts_.unconverged += outcome.converged ? 0 : 1;
}

// Moves alone: what is nearer than it should be goes back without a velocity, which would be energy.
template <class Real>
void SurfaceContacts<Real>::solve_places(double dt_s) {
  double shortest_m_s = 0.0;
  for (ContactRow& row : rows_) {
    row.free_m_s = relative(
        row, [&](std::uint32_t body, std::uint32_t vertex) -> Vec3d { return bodies_[body].move_m(vertex) / dt_s; });
    row.least_m_s = (row.gap_m > 0.0 ? -row.gap_m : -row.gap_m * std::min(1.0, dt_s / surface_overlap_time_s)) / dt_s;
    row.impulse_n_s.setZero();
    row.friction = 0.0;
    shortest_m_s = std::max(shortest_m_s, row.least_m_s - row.free_m_s.dot(row.normal));
  }
  if (shortest_m_s <= 0.0) return;
  (void)solve_rows(rows_, responses_,
                   {.sweeps_max = surface_sweeps_max, .enough_m_s = surface_enough_share * shortest_m_s});
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
void SurfaceContacts<Real>::find_all(std::span<const SoftState<Real>> soft, std::span<const std::uint8_t> active) {
  load_ways(soft, active, true);
  find_pairs(soft);
  for (std::uint32_t i = 0; i < soft.size(); ++i) {
    if (active[i] == 0) continue;
    SurfaceBody& body = bodies_[i];
    std::ranges::fill(body.cuts, 1.0);
    if (loaded_[i] != 0) continue;
    for (std::size_t k = 0; k < body.from.size(); ++k) {
      body.from[k] = soft[i].position_m(k);
      body.to[k] = body.from[k] + soft[i].dr[k].template cast<double>();
    }
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
    Box way = start_boxes_[i];
    for (const Vec3d& at : body.from) way.include(at);
    for (const Vec3d& at : body.to) way.include(at);
    const Vec3d margin = Vec3d::Constant(body.margin_m);
    body.way = {way.low - margin, way.high + margin};
    body.boxed_to = body.to;
    loaded_[i] = 1;  // as they are now, not as the substep found them
  }
  find_pairs(soft);
}

template <class Real>
void SurfaceContacts<Real>::cut(std::span<SoftState<Real>> soft) {
  bool holds = true;
  for (const std::uint32_t i : seen_) {
    SurfaceBody& body = bodies_[i];
    if (loaded_[i] != 0) {
      for (std::size_t k = 0; k < body.from.size(); ++k) {
        body.to[k] = body.from[k] + soft[i].dr[k].template cast<double>();
      }
      holds = holds && keeps_to_boxes(body);
    } else {
      const Box moves = box_of(soft[i].dr);
      const Box& start = start_boxes_[i];
      const Vec3d shell = Vec3d::Constant((1.0 + row_slack_share) * body.shell_m);
      holds = holds && ((start.low + moves.low - shell).array() >= body.way.low.array()).all() &&
              ((start.high + moves.high + shell).array() <= body.way.high.array()).all();
    }
  }
  if (!holds) {
    const std::vector<std::uint8_t> active(soft.size(), 1);
    load_ways(soft, active, false);
    find_pairs(soft);
  }
  if (pairs_.empty()) return;
  carry(soft.size());
  (void)cut_moves(pairs_, bodies_);
  for_paired_vertices([&](std::uint32_t body, std::uint32_t vertex) {
    const SurfaceBody& surface = bodies_[body];
    const double cut = surface.cuts[vertex];
    if (cut >= 1.0) return;
    if (carried_[body] == 0) {
      soft[body].dr[vertex] *= static_cast<Real>(cut);
    } else {
      const Vec3d end = surface.from[vertex] + cut * surface.move_m(vertex);
      soft[body].dr[vertex] = (end - soft[body].position_m(vertex)).template cast<Real>();
    }
    ++counts_.cut_vertices;
  });
}

template <class Real>
std::size_t SurfaceContacts<Real>::bytes() const {
  std::size_t sum = pairs_.capacity() * sizeof(SurfacePair) + rows_.capacity() * sizeof(ContactRow) +
                    responses_.capacity() * sizeof(Response) + start_boxes_.capacity() * sizeof(Box);
  for (const SurfacePair& pair : pairs_) sum += pair.candidates.capacity() * sizeof(Candidate);
  for (const SurfaceBody& body : bodies_) sum += body.bytes();
  for (const auto& topology : topologies_) sum += topology->bytes();
  return sum;
}

template class SurfaceContacts<float>;
template class SurfaceContacts<double>;

}  // namespace pneuma::physics
