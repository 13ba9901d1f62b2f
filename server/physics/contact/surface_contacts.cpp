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

// What follows may change a move by this much before its candidates are found anew: of the body's moves, and of the
// shell.
constexpr double move_slack_share = 0.1;
constexpr double shell_slack_share = 0.5;
// Of the shell: what moves that must not cross keep to each side (filter.h keeps a tenth).
constexpr double crossing_share = 0.25;
// What is kept from tick to tick, here and for rows: no more than a world is estimated to take (app/world_bytes.h).
constexpr std::size_t kept_bytes_per_vertex = 1'700;
// In which bodies that were put into each other move by the smaller one's length.
constexpr double parting_time_s = 0.3;

// Sets the box of the ways from where the vertices were loaded by way of where they are.
void fit_way(SurfaceBody& body) {
  Box way = body.at;
  for (const Vec3d& at : body.from) way.include(at);
  for (const Vec3d& at : body.to) way.include(at);
  const Vec3d margin = Vec3d::Constant(body.margin_m);
  body.way = {way.low - margin, way.high + margin};
}

bool keeps_to_boxes(const SurfaceBody& body) {
  for (std::size_t i = 0; i < body.to.size(); ++i) {
    if (!((body.to[i] - body.boxed_to[i]).cwiseAbs().maxCoeff() <= body.slack_m)) return false;
  }
  return true;
}

double squared_distance_m2(const Vec3d& point, const Vec3d& start, const Vec3d& end) {
  const Vec3d way = end - start;
  const double way_m2 = way.squaredNorm();
  const double share = way_m2 > 0.0 ? std::clamp(way.dot(point - start) / way_m2, 0.0, 1.0) : 0.0;
  return (point - start - share * way).squaredNorm();
}

// Marks the vertices that end further beside the ways that their candidates were found for than these have room.
void mark_astray(SurfaceBody& body) {
  const double room_m = body.margin_m - crossing_share * body.shell_m;
  body.any_astray = false;
  body.astray.resize(body.to.size());
  for (std::size_t i = 0; i < body.to.size(); ++i) {
    const bool strays = !(squared_distance_m2(body.to[i], body.from[i], body.boxed_to[i]) <= room_m * room_m);
    body.astray[i] = strays ? 1 : 0;
    body.any_astray = body.any_astray || strays;
  }
}

}  // namespace

template <class Real>
void mark_free(const SoftState<Real>& state, SurfaceBody& surface) {
  const bool is_tied = state.tie != 0;
  surface.free.assign(state.x.size(), state.is_awake() && !is_tied ? 1 : 0);
  for (const Grab& grab : state.grabs) surface.free[grab.vertex] = 0;
}
template void mark_free(const SoftState<float>&, SurfaceBody&);
template void mark_free(const SoftState<double>&, SurfaceBody&);

template <class Real>
std::shared_ptr<const SurfaceTopology> SurfaceContacts<Real>::topology_of(const std::shared_ptr<const Mesh>& mesh) {
  const auto known = std::ranges::find(topologies_, mesh, [](const auto& topology) { return topology->mesh; });
  if (known != topologies_.end()) return *known;
  topologies_.push_back(make_surface_topology(mesh));
  return topologies_.back();
}

template <class Real>
void SurfaceContacts<Real>::take_meshes(std::span<const ColliderState> colliders, double dt_s) {
  find_mesh_colliders(colliders, dt_s, meshes_);
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

template <class Real>
void SurfaceContacts<Real>::load(std::span<const SoftState<Real>> soft, std::span<const BodyBounds> bounds, Whose whose,
                                 double moves) {
  load_meshes(soft.size());
  loaded_.clear();
  meeting_.clear();
  for (std::uint32_t i = 0; i < soft.size(); ++i) {
    const SoftState<Real>& state = soft[i];
    const bool meets_others = state.body.collision.soft == SoftCollision::exact;
    const bool is_seen = meets_others || state.body.collision.self || !meshes_.empty();
    if (!bounds[i].active || (whose == Whose::of_those_that_meet && !is_seen)) continue;
    SurfaceBody& body = bodies_[i];
    if (!body.topology) load_tables(state, body);
    load_vertices(state, moves, body);
    loaded_.push_back(i);
    if (meets_others) meeting_.push_back(i);
  }
  list_selves(soft);
  vertices_ = 0;
  for (const std::uint32_t i : loaded_) vertices_ += bodies_[i].from.size();
  for (std::size_t i = meshes_begin_; i < bodies_.size(); ++i) vertices_ += bodies_[i].from.size();
}

template <class Real>
void SurfaceContacts<Real>::list_selves(std::span<const SoftState<Real>> soft) {
  selves_.clear();
  for (const std::uint32_t i : loaded_) {
    if (soft[i].body.collision.self && soft[i].is_awake()) selves_.push_back(i);
  }
}

template <class Real>
void SurfaceContacts<Real>::load_vertices(const SoftState<Real>& state, double moves, SurfaceBody& body) {
  std::ranges::fill(body.cuts, 1.0);
  body.free.clear();
  body.drifts.clear();
  for (std::size_t i = 0; i < body.from.size(); ++i) body.from[i] = state.position_m(i);
  body.at = {};
  for (const Vec3d& at : body.from) body.at.include(at);
  if (state.is_awake()) {
    for (std::size_t i = 0; i < body.to.size(); ++i) body.to[i] = state.dr[i].template cast<double>();
    body.substep = drift_of(body.to.size(), [&](std::size_t i) -> const Vec3d& { return body.to[i]; });
    for (std::size_t i = 0; i < body.to.size(); ++i) body.to[i] = body.from[i] + moves * body.to[i];
  } else {
    body.substep = {};
    body.to = body.from;
  }
  body.boxed_to = body.to;
  body.margin_m = 0.0;
  fit_way(body);
  const double move_m = (body.way.high - body.at.high).cwiseMax(body.at.low - body.way.low).norm();
  body.slack_m = move_slack_share * move_m + shell_slack_share * body.shell_m;
  body.margin_m = (1.0 + row_slack_share) * body.shell_m + body.slack_m;
  body.way.low.array() -= body.margin_m;
  body.way.high.array() += body.margin_m;
}

template <class Real>
void SurfaceContacts<Real>::list_near(std::span<const SoftState<Real>> soft) {
  near_.clear();
  for_near(soft, [&](std::uint32_t first, std::uint32_t second) { near_.emplace_back(first, second); });
  std::ranges::sort(near_);
}

// What there is already took its share.
template <class Real>
void SurfaceContacts<Real>::begin_looks() {
  std::size_t taken = 0;
  for (const auto* list : {&room_->pairs, &room_->next_pairs}) {
    for (const SurfacePair& pair : *list) taken += pair.candidates.size();
  }
  const std::size_t most = feature_looks_max(vertices_);
  looks_left_ = most - std::min(taken, most - 1);
}

template <class Real>
bool SurfaceContacts<Real>::is_crowded(std::span<const SoftState<Real>> soft, const SurfacePair& pair) {
  const auto is_out = [&](std::uint32_t body) { return body < soft.size() && soft[body].is_crowded; };
  return is_out(pair.first) || is_out(pair.second);
}

// Their pairs stay in the lists, as the loops over these go on, without what they found.
template <class Real>
void SurfaceContacts<Real>::leave_out(std::span<const std::uint32_t> crowd, std::span<SoftState<Real>> soft) {
  for (const std::uint32_t body : crowd) {
    soft[body].is_crowded = true;
    looks_.forget(body);
    for (auto* list : {&loaded_, &meeting_, &selves_}) std::erase(*list, body);
  }
  for (auto* list : {&room_->pairs, &room_->next_pairs}) {
    for (SurfacePair& pair : *list) {
      if (is_crowded(soft, pair)) pair.candidates = {};
    }
  }
}

template <class Real>
void SurfaceContacts<Real>::erase_crowded(std::span<const SoftState<Real>> soft) {
  std::erase_if(room_->pairs, [&](const SurfacePair& pair) { return is_crowded(soft, pair); });
  std::erase_if(crossed_, [&](const BodyPair& pair) { return is_crowded(soft, {pair.first, pair.second}); });
}

template <class Real>
void SurfaceContacts<Real>::count_looks(const SurfacePair& pair, std::size_t looks, Takings& takings) const {
  takings.add(pair.first, looks);
  if (pair.second != pair.first && !is_mesh(pair.second)) takings.add(pair.second, looks);
}

// Calls look(), and again without those that took most where it took more than is left. False where a body of the pair
// was among them. Meshes are not asked: they were there before.
template <class Real>
template <class Finder, class Look>
bool SurfaceContacts<Real>::take_looks(std::span<SoftState<Real>> soft, SurfacePair& pair, Finder& finder,
                                       const Look& look) {
  const std::size_t known = pair.candidates.size();
  while (!is_crowded(soft, pair)) {
    finder.allow(looks_left_);
    look();
    const std::size_t taken = looks_left_ - finder.looks_left();
    looks_left_ = finder.looks_left();
    if (looks_left_ > 0) {
      count_looks(pair, taken, looks_);
      return true;
    }
    Takings asked = looks_;
    count_looks(pair, taken, asked);
    leave_out(asked.greatest(), soft);
    pair.candidates.resize(std::min(known, pair.candidates.size()));
    begin_looks();
  }
  return false;
}

// A pair that does not cross never will; so each is looked at when it first comes near, and while it is crossed.
template <class Real>
bool SurfaceContacts<Real>::is_crossed(std::span<const SoftState<Real>> soft, const SurfacePair& pair) {
  if (pair.first == pair.second || is_crowded(soft, pair)) return false;
  const BodyPair key(pair.first, pair.second);
  const auto known = std::ranges::lower_bound(clear_, key);
  if (known != clear_.end() && *known == key) return false;
  // A restored world looks at pairs that another one knows, and is to stop the same bodies. So where this takes too
  // many looks, the pair is left to its candidates, which count.
  room_->finder.allow(feature_looks_max(vertices_));
  if (room_->finder.are_crossed(pair, bodies_)) return true;
  // A mesh that moves may run over a body between it and another one.
  if (!is_mesh(pair.second) || !mesh(pair.second).moves) clear_.insert(known, key);
  return false;
}

// False where a body of the pair is crowded.
template <class Real>
bool SurfaceContacts<Real>::find_candidates(std::span<SoftState<Real>> soft, SurfacePair& pair) {
  if (is_mesh(pair.second)) {
    MeshCandidateFinder& finder = room_->mesh_finder;
    return take_looks(soft, pair, finder, [&] { finder.find(mesh(pair.second), pair, bodies_); });
  }
  return take_looks(soft, pair, room_->finder, [&] { room_->finder.find(pair, bodies_); });
}

template <class Real>
void SurfaceContacts<Real>::find_pairs(std::span<SoftState<Real>> soft) {
  list_near(soft);
  crossed_.clear();
  for (SurfacePair& pair : room_->pairs) pair.candidates.clear();
  room_->next_pairs.clear();
  looks_.begin(bodies_.size());
  begin_looks();
  std::size_t count = 0;
  for (const auto& [first, second] : near_) {
    if (room_->pairs.size() == count) room_->pairs.emplace_back();
    SurfacePair& pair = room_->pairs[count];
    pair.first = first;
    pair.second = second;
    if (is_crossed(soft, pair)) {
      crossed_.emplace_back(first, second);
    } else if (find_candidates(soft, pair)) {
      ++count;
    }
  }
  room_->pairs.resize(count);
  erase_crowded(soft);
}

// The boxes hold all ways from where the bodies were loaded to near where they went then.
template <class Real>
void SurfaceContacts<Real>::update_candidates(std::span<SoftState<Real>> soft) {
  if (std::ranges::all_of(loaded_, [&](std::uint32_t i) { return keeps_to_boxes(bodies_[i]); })) return;
  for (const std::uint32_t i : loaded_) {
    fit_way(bodies_[i]);
    bodies_[i].boxed_to = bodies_[i].to;
  }
  find_pairs(soft);
}

// Candidates hold where no vertex that strayed belongs to a face that may meet the other body.
template <class Real>
void SurfaceContacts<Real>::update_crossing_candidates(std::span<SoftState<Real>> soft, bool any_woken) {
  for (const std::uint32_t i : loaded_) {
    mark_astray(bodies_[i]);
    fit_way(bodies_[i]);
  }
  const bool any_astray = std::ranges::any_of(loaded_, [&](std::uint32_t i) { return bodies_[i].any_astray; });
  if (!any_astray && !any_woken) return;
  if (any_woken) list_selves(soft);
  list_near(soft);
  room_->next_pairs.clear();
  looks_.begin(bodies_.size());
  for (const SurfacePair& pair : room_->pairs) count_looks(pair, pair.candidates.size(), looks_);
  begin_looks();
  auto old = room_->pairs.begin();
  for (const BodyPair& near : near_) {
    const auto key = [](const SurfacePair& pair) { return BodyPair(pair.first, pair.second); };
    while (old != room_->pairs.end() && key(*old) < near) ++old;
    if (old != room_->pairs.end() && key(*old) == near) {
      SurfacePair& pair = room_->next_pairs.emplace_back(std::move(*old));
      if (!bodies_[near.first].any_astray && !bodies_[near.second].any_astray) continue;
      const bool is_whole = is_mesh(near.second) || near.first == near.second;
      if (is_whole) {
        looks_left_ += pair.candidates.size();
        pair.candidates.clear();
      }
      const std::size_t known = is_whole ? 0 : pair.candidates.size();
      const auto add_astray = [&] {
        pair.candidates.resize(known);
        room_->finder.add_astray(pair, bodies_);
      };
      const bool is_in = is_whole ? find_candidates(soft, pair) : take_looks(soft, pair, room_->finder, add_astray);
      if (is_in) room_->measures.measure(pair, bodies_, known);
    } else if (std::ranges::binary_search(crossed_, near)) {
      continue;
    } else {
      SurfacePair pair{near.first, near.second};
      if (is_crossed(soft, pair) || !find_candidates(soft, pair)) continue;
      room_->measures.measure(pair, bodies_);
      room_->next_pairs.push_back(std::move(pair));
    }
  }
  room_->pairs.swap(room_->next_pairs);
  erase_crowded(soft);
}

template <class Real>
void SurfaceContacts<Real>::find_rows(std::span<SoftState<Real>> soft, std::vector<ContactRow>& rows) {
  for (SurfacePair& pair : room_->pairs) room_->measures.measure(pair, bodies_);
  RowFinder& finder = room_->row_finder;
  while (finder.find(room_->pairs, bodies_) > skin_rows_max(vertices_)) {
    looks_.begin(bodies_.size());
    for (std::size_t i = 0; i < room_->pairs.size(); ++i) {
      const SurfacePair& pair = room_->pairs[i];
      looks_.add(pair.first, finder.count_of(i));
      if (!is_mesh(pair.second)) looks_.add(pair.second, finder.count_of(i));
    }
    leave_out(looks_.greatest(), soft);
    erase_crowded(soft);
  }
  finder.append(room_->pairs, bodies_, rows);
}

template <class Real>
void SurfaceContacts<Real>::add_ways_out(std::vector<ContactRow>& rows) const {
  for (const auto& [first, second] : crossed_) {
    if (is_mesh(second)) find_ways_out(mesh(second), first, second, bodies_, rows);
  }
}

template <class Real>
void SurfaceContacts<Real>::carry(std::size_t soft_count) {
  if (!std::exchange(may_carry_, false)) return;
  carry_with_meshes(room_->pairs, meshes_, soft_count, bodies_, carried_);
}

// What is taken along may leave the ways that the candidates are of. Then they are found for its new way, on which it
// is only cut.
template <class Real>
StoppedFeatures SurfaceContacts<Real>::filter(std::span<SoftState<Real>> soft) {
  std::vector<FeatureCorners> stopped = cut_moves(room_->pairs, bodies_);
  StoppedFeatures features(stopped);
  bool any_taken_along = false;
  for (StoppedFeatures::Vertex& of : features.vertices()) {
    SurfaceBody& body = bodies_[of.body];
    const Vec3d end_m = body.from[of.vertex] + body.cut_move_m(of.vertex);
    of.share = body.cuts[of.vertex];
    of.missed_m = body.to[of.vertex] - end_m;
    any_taken_along = any_taken_along || (!body.drifts.empty() && !body.drifts[of.vertex].isZero(0.0));
  }
  if (!any_taken_along) return features;
  for (const StoppedFeatures::Vertex& of : features.vertices()) {
    bodies_[of.body].to[of.vertex] -= of.missed_m;
    bodies_[of.body].cuts[of.vertex] = 1.0;
  }
  for (const std::uint32_t i : loaded_) {
    bodies_[i].free.clear();
    bodies_[i].drifts.clear();
  }
  update_crossing_candidates(soft, false);
  const std::vector<FeatureCorners> again = cut_moves(room_->pairs, bodies_);
  if (again.empty()) return features;
  stopped.insert(stopped.end(), again.begin(), again.end());
  StoppedFeatures all(stopped);
  auto before = features.vertices().begin();
  for (StoppedFeatures::Vertex& of : all.vertices()) {
    const SurfaceBody& body = bodies_[of.body];
    of.share = body.cuts[of.vertex];
    of.missed_m = (1.0 - of.share) * body.move_m(of.vertex);
    if (before == features.vertices().end() || before->body != of.body || before->vertex != of.vertex) continue;
    of.share *= before->share;
    of.missed_m += before->missed_m;
    ++before;
  }
  return all;
}

// A body that was moved so may run through a third one now, so its pairs are looked at once more.
template <class Real>
void SurfaceContacts<Real>::part(std::span<SoftState<Real>> soft, double dt_s) {
  if (!crossed_.empty()) room_->finder.allow(feature_looks_max(vertices_));
  for (const auto& [first, second] : crossed_) {
    if (is_mesh(second)) continue;
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
    const Vec3d way = room_->finder.way_apart({first, second}, bodies_);
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
std::size_t SurfaceContacts<Real>::kept_bytes_max() const {
  return vertices_ * kept_bytes_per_vertex;
}

std::size_t SurfaceRoom::bytes() const {
  std::size_t sum = (pairs.capacity() + next_pairs.capacity()) * sizeof(SurfacePair) + finder.bytes() +
                    mesh_finder.bytes() + measures.bytes() + row_finder.bytes();
  for (const auto* list : {&pairs, &next_pairs}) {
    for (const SurfacePair& pair : *list) sum += pair.candidates.capacity() * sizeof(Candidate);
  }
  return sum;
}

template <class Real>
std::size_t SurfaceContacts<Real>::bytes() const {
  std::size_t sum = room_.held() != nullptr ? room_.held()->bytes() : 0;
  for (const SurfaceBody& body : bodies_) sum += body.bytes();
  for (const auto& topology : topologies_) sum += topology->bytes();
  return sum;
}

template class SurfaceContacts<float>;
template class SurfaceContacts<double>;

}  // namespace pneuma::physics
