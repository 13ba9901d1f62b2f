// Soft bodies whose surfaces meet as they are: triangle against triangle, with other bodies and with themselves.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "physics/contact/candidates.h"
#include "physics/contact/contact_bounds.h"
#include "physics/contact/contact_note.h"
#include "physics/contact/feature_measures.h"
#include "physics/contact/lumped_solver.h"
#include "physics/contact/mesh_colliders.h"
#include "physics/contact/pair_watch.h"
#include "physics/contact/row.h"
#include "physics/contact/surface_body.h"
#include "physics/contact/surface_rows.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// The rows of one world's soft bodies among each other. Between substeps it holds lists that save work; what they give
/// is what fresh ones would.
template <class Real>
class SurfaceContacts {
 public:
  /// Whether the two are to meet by their surfaces.
  [[nodiscard]] static bool asks_for(const SoftState<Real>& a, const SoftState<Real>& b) {
    return a.body.collision.soft == SoftCollision::exact && b.body.collision.soft == SoftCollision::exact;
  }

  /// Colliders that are meshes take part from here on, in this substep: their surfaces come behind the soft bodies'.
  void take_meshes(std::span<const ColliderState> colliders, double dt_s, double resting_m_s);
  [[nodiscard]] std::span<const MeshCollider> meshes() const { return meshes_; }
  /// Appends the rows by which bodies that were put across a mesh leave it.
  void add_ways_out(std::vector<ContactRow>& rows) const;
  /// Once, before moves are cut: see carry_with_meshes.
  void carry(std::size_t soft_count);

  /// What a substep hands to surfaces; `bounds` are of its moves, one a soft body.
  struct Substep {
    std::span<SoftState<Real>> soft;
    std::span<const BodyBounds> bounds;
    double dt_s = 0.0;
    bool is_first = false;  // of its tick
  };

  /// Answers the contacts of the moves `dr` by impulses: changes v and dr. Sets `touched[i]` of bodies that got any.
  void answer(const Substep& substep, std::span<ContactNotes> notes, std::span<std::uint8_t> touched);

  /// Moves bodies that were put into each other apart, whole and without a velocity: by the smaller one's length in
  /// `parting_time_s`. What they approach each other by ends.
  void part(std::span<SoftState<Real>> soft, double dt_s);

  /// Cuts the moves so that nothing crosses, as whatever came after answer() left them.
  void cut(const Substep& substep);

  /// For passes that find their rows themselves: near pairs with their candidates, and all active bodies with their
  /// vertices' places, also those that meet no soft body.
  void find_all(std::span<const SoftState<Real>> soft, std::span<const BodyBounds> bounds);
  /// After the bodies' `to` have changed: the candidates of what may meet now.
  void update_candidates(std::span<const SoftState<Real>> soft);
  /// Appends the rows of the pairs.
  void find_rows(std::vector<ContactRow>& rows);
  [[nodiscard]] std::span<SurfacePair> pairs() { return pairs_; }
  [[nodiscard]] std::vector<SurfaceBody>& bodies() { return bodies_; }

  [[nodiscard]] const RowCounts& counts() const { return counts_; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  // Of a row's last solve in this tick, from which the next one starts.
  struct WarmImpulse {
    FeatureKey key;
    Vec3d impulse_n_s = Vec3d::Zero();
  };

  void load_meshes(std::size_t soft_count);
  [[nodiscard]] double bounce_m_s(std::span<const SoftState<Real>> soft, const ContactRow& row, double approach_m_s);
  void load_tables(const SoftState<Real>& state, SurfaceBody& body);
  void load_ways(std::span<const SoftState<Real>> soft, std::span<const BodyBounds> bounds, bool all);
  void load_vertices(const SoftState<Real>& state, SurfaceBody& body);
  void load_moves(const SoftState<Real>& state, SurfaceBody& body);
  void find_pairs(std::span<const SoftState<Real>> soft, bool watched);
  [[nodiscard]] bool pairs_hold();
  void keep_watches();
  void solve_velocities(std::span<const SoftState<Real>> soft, double dt_s, bool warm);
  void solve_places(std::span<SoftState<Real>> soft, double dt_s);
  void note(std::span<ContactNotes> notes, std::span<std::uint8_t> touched) const;
  [[nodiscard]] std::shared_ptr<const SurfaceTopology> topology_of(const std::shared_ptr<const Mesh>& mesh);

  std::vector<std::shared_ptr<const SurfaceTopology>> topologies_;  // one a mesh
  std::vector<SurfaceBody> bodies_;                                 // one a soft body, then one a mesh collider
  std::vector<std::uint8_t> loaded_;                                // likewise: its vertices are, in this substep
  std::vector<std::uint32_t> meeting_;                              // the bodies that meet others in this substep
  std::vector<std::uint32_t> selves_;                               // and those that meet themselves
  std::vector<std::uint32_t> seen_;                                 // and those that meet anything
  std::vector<MeshCollider> meshes_;                                // colliders; their surfaces follow the soft bodies'
  std::size_t meshes_begin_ = 0;                                    // the first of them in bodies_
  double mesh_dt_s_ = 0.0;
  double mesh_resting_m_s_ = 0.0;
  std::vector<std::optional<Vec3d>> means_m_s_;  // one a soft body that hits a mesh: its vertices' mean velocity
  std::vector<std::uint8_t> carried_;            // one a body: by a mesh
  bool may_carry_ = false;                       // meshes have not moved yet in this substep
  std::vector<SurfacePair> pairs_;               // near ones, sorted
  std::vector<std::pair<std::uint32_t, std::uint32_t>> near_;     // bodies whose ways' boxes overlap, sorted
  std::vector<std::pair<std::uint32_t, std::uint32_t>> clear_;    // pairs known not to cross, sorted
  std::vector<std::pair<std::uint32_t, std::uint32_t>> crossed_;  // near ones that do, in this substep, sorted
  std::vector<PairWatch> watches_;                                // of near pairs, sorted
  std::vector<PairWatch> next_watches_;                           // scratch
  std::vector<Vec3d> moves_m_;                                    // scratch
  std::vector<std::vector<Vec3d>> places_m_;                      // scratch of carry()
  CandidateFinder finder_;
  MeshCandidateFinder mesh_finder_;
  FeatureMeasures measures_;
  RowFinder row_finder_;
  std::vector<ContactRow> rows_;
  std::vector<WarmImpulse> warm_;  // sorted
  LumpedSolver solver_;
  RowCounts counts_;
};

}  // namespace pneuma::physics
