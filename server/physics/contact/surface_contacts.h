// The surfaces of a world's soft bodies and mesh colliders: who is near whom, by which features, and what rows these
// make. Who answers by masses (lumped_contacts.h) and who is solved for (coupled_step.h) both ask here.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "physics/contact/candidates.h"
#include "physics/contact/contact_bounds.h"
#include "physics/contact/crowding.h"
#include "physics/contact/feature_measures.h"
#include "physics/contact/mesh_colliders.h"
#include "physics/contact/row.h"
#include "physics/contact/stopped_features.h"
#include "physics/contact/surface_body.h"
#include "physics/contact/surface_rows.h"
#include "physics/machine/room_pool.h"
#include "physics/rigid/sweep.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// What finding pairs and rows takes.
struct SurfaceRoom {
  std::vector<SurfacePair> pairs;       // near ones, sorted
  std::vector<SurfacePair> next_pairs;  // scratch
  CandidateFinder finder;
  MeshCandidateFinder mesh_finder;
  FeatureMeasures measures;
  RowFinder row_finder;

  void clear() {}  // it points to nothing
  [[nodiscard]] std::size_t bytes() const;
};

/// Marks the vertices of a body that is awake which neither a hand nor a joint holds. What solids hold is left to be
/// taken out.
template <class Real>
void mark_free(const SoftState<Real>& state, SurfaceBody& surface);

/// Between ticks it holds lists that save work; what they give is what fresh ones would.
template <class Real>
class SurfaceContacts {
 public:
  /// Whether the two are to meet by their surfaces.
  [[nodiscard]] static bool asks_for(const SoftState<Real>& a, const SoftState<Real>& b) {
    return a.body.collision.soft == SoftCollision::exact && b.body.collision.soft == SoftCollision::exact;
  }

  /// Colliders that are meshes take part from here on, in this substep: their surfaces come behind the soft bodies'.
  void take_meshes(std::span<const ColliderState> colliders, double dt_s);
  [[nodiscard]] std::span<const MeshCollider> meshes() const { return meshes_; }
  [[nodiscard]] bool is_mesh(std::uint32_t body) const { return body >= meshes_begin_; }
  [[nodiscard]] const MeshCollider& mesh(std::uint32_t body) const { return meshes_[body - meshes_begin_]; }
  /// How far the mesh takes its vertex in the substep, once it has gone there.
  [[nodiscard]] Vec3d mesh_move_m(std::uint32_t body, std::uint32_t vertex) const {
    const Vec3d& end_m = bodies_[body].from[vertex];
    return end_m - mesh(body).start.to_world(mesh(body).end.to_local(end_m));
  }

  /// Whose surfaces are loaded.
  enum class Whose { all, of_those_that_meet };
  /// Sets where bodies are, and where so many moves like that of the substep under way would take them. Bounds are one
  /// a soft body.
  void load(std::span<const SoftState<Real>> soft, std::span<const BodyBounds> bounds, Whose whose, double moves);
  /// Calls visit(first, second) for each two loaded bodies, or body and itself, whose ways' boxes overlap; meshes
  /// too. Not in any order.
  template <class Visit>
  void for_near(std::span<const SoftState<Real>> soft, const Visit& visit);
  /// Sets the near pairs with their candidates, sorted. Here and below, whoever is crowded (crowding.h) is marked, and
  /// no longer loaded.
  void find_pairs(std::span<SoftState<Real>> soft);

  /// After the bodies' `to` have changed, and their `from` along their ways: the candidates of what may meet now.
  void update_candidates(std::span<SoftState<Real>> soft);
  /// After the bodies' `to` alone have changed, and not for rows: the candidates of what may cross on its way. Say if
  /// bodies have been woken since they were loaded: their pairs are looked for.
  void update_crossing_candidates(std::span<SoftState<Real>> soft, bool any_woken);

  /// Measures the pairs' candidates and appends their rows.
  void find_rows(std::span<SoftState<Real>> soft, std::vector<ContactRow>& rows);
  /// Appends the rows by which bodies that were put across a mesh leave it.
  void add_ways_out(std::vector<ContactRow>& rows) const;
  /// Once, before moves are cut: see carry_with_meshes.
  void carry(std::size_t soft_count);
  /// Cuts the moves (filter.h), also of those who are taken along beside their ways, and returns what was stopped.
  /// `bodies()` says who is free. Afterwards a vertex goes by its cut_move_m; `to` of one that was taken along has
  /// changed.
  [[nodiscard]] StoppedFeatures filter(std::span<SoftState<Real>> soft);
  /// Moves bodies that were put into each other apart, whole and without a velocity: by the smaller one's length in
  /// `parting_time_s`. What they approach each other by ends.
  void part(std::span<SoftState<Real>> soft, double dt_s);

  [[nodiscard]] std::span<SurfacePair> pairs() { return room_->pairs; }
  [[nodiscard]] std::vector<SurfaceBody>& bodies() { return bodies_; }
  [[nodiscard]] const std::vector<SurfaceBody>& bodies() const { return bodies_; }
  [[nodiscard]] std::span<const std::uint32_t> loaded() const { return loaded_; }

  /// At a tick's end.
  void give_back_room() { room_.give_back(kept_bytes_max()); }
  /// Of what is used in turns: what bodies of this size may keep, where they need more than a pool lends. Past it the
  /// world would have more than it was taken in for.
  [[nodiscard]] std::size_t kept_bytes_max() const;

  [[nodiscard]] std::size_t bytes() const;

 private:
  void load_meshes(std::size_t soft_count);
  void load_tables(const SoftState<Real>& state, SurfaceBody& body);
  void load_vertices(const SoftState<Real>& state, double moves, SurfaceBody& body);
  void list_selves(std::span<const SoftState<Real>> soft);
  void list_near(std::span<const SoftState<Real>> soft);
  void begin_looks();
  [[nodiscard]] static bool is_crowded(std::span<const SoftState<Real>> soft, const SurfacePair& pair);
  void leave_out(std::span<const std::uint32_t> crowd, std::span<SoftState<Real>> soft);
  void erase_crowded(std::span<const SoftState<Real>> soft);
  template <class Finder, class Look>
  [[nodiscard]] bool take_looks(std::span<SoftState<Real>> soft, SurfacePair& pair, Finder& finder, const Look& look);
  void count_looks(const SurfacePair& pair, std::size_t looks, Takings& takings) const;
  [[nodiscard]] bool is_crossed(std::span<const SoftState<Real>> soft, const SurfacePair& pair);
  [[nodiscard]] bool find_candidates(std::span<SoftState<Real>> soft, SurfacePair& pair);
  [[nodiscard]] std::shared_ptr<const SurfaceTopology> topology_of(const std::shared_ptr<const Mesh>& mesh);

  using BodyPair = std::pair<std::uint32_t, std::uint32_t>;

  std::vector<std::shared_ptr<const SurfaceTopology>> topologies_;  // one a mesh
  std::vector<SurfaceBody> bodies_;                                 // one a soft body, then one a mesh collider
  std::vector<std::uint32_t> loaded_;                               // the soft bodies that are
  std::vector<std::uint32_t> meeting_;                              // and of these those that meet others
  std::vector<std::uint32_t> selves_;                               // and those that meet themselves
  std::vector<MeshCollider> meshes_;                                // colliders; their surfaces follow the soft bodies'
  std::size_t meshes_begin_ = 0;                                    // the first of them in bodies_
  bool may_carry_ = false;                                          // meshes have not moved yet in this substep
  std::vector<BodyPair> near_;                                      // bodies whose ways' boxes overlap, sorted
  std::vector<BodyPair> clear_;                                     // pairs known not to cross, sorted
  std::vector<BodyPair> crossed_;                                   // near ones that do, sorted
  std::vector<std::uint8_t> carried_;                               // scratch of carry()
  std::size_t vertices_ = 0;                                        // of the loaded bodies and the meshes
  std::size_t looks_left_ = 0;                                      // that pairs may take yet
  Takings looks_;                                                   // by body
  Borrowed<SurfaceRoom> room_;                                      // within a tick
};

template <class Real>
template <class Visit>
void SurfaceContacts<Real>::for_near(std::span<const SoftState<Real>> soft, const Visit& visit) {
  for (const std::uint32_t i : selves_) visit(i, i);
  sort_and_sweep(
      meeting_, [&](std::uint32_t i) { return bodies_[i].way.low.x(); },
      [&](std::uint32_t i) { return bodies_[i].way.high.x(); },
      [&](std::uint32_t a, std::uint32_t b) {
        if (!soft[a].is_awake() && !soft[b].is_awake()) return;
        if (bodies_[a].way.overlaps(bodies_[b].way)) visit(std::min(a, b), std::max(a, b));
      });
  for (auto mesh = static_cast<std::uint32_t>(meshes_begin_); mesh < bodies_.size(); ++mesh) {
    for (const std::uint32_t i : loaded_) {
      if (soft[i].is_awake() && bodies_[i].way.overlaps(bodies_[mesh].way)) visit(i, mesh);
    }
  }
}

}  // namespace pneuma::physics
