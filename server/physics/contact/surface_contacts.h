// Soft bodies whose surfaces meet as they are: triangle against triangle, with other bodies and with themselves.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "physics/contact/candidates.h"
#include "physics/contact/contact_note.h"
#include "physics/contact/mesh_colliders.h"
#include "physics/contact/row.h"
#include "physics/contact/solver.h"
#include "physics/contact/surface_body.h"
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
  /// Of two that ask for it: whether they do so in this substep. Bodies that were put into each other meet by their
  /// bounds, which part them, until they do not run through each other any more.
  [[nodiscard]] bool meets(std::uint32_t a, std::uint32_t b) const;

  /// Colliders that are meshes take part from here on, in this substep: their surfaces come behind the soft bodies'.
  void take_meshes(std::span<const ColliderState> colliders, double dt_s, double resting_m_s);
  [[nodiscard]] std::span<const MeshCollider> meshes() const { return meshes_; }
  /// Appends the rows by which bodies that were put across a mesh leave it.
  void add_ways_out(std::vector<ContactRow>& rows) const;
  /// Once, before moves are cut: see carry_with_meshes.
  void carry(std::size_t soft_count);

  /// Answers the contacts of the moves `dr` by impulses: changes v and dr. Sets `touched[i]` of bodies that got any.
  void answer(std::span<SoftState<Real>> soft, std::span<const std::uint8_t> active, double dt_s,
              std::span<ContactNotes> notes, std::span<std::uint8_t> touched);

  /// Cuts the moves so that nothing crosses, as whatever came after answer() left them.
  void cut(std::span<SoftState<Real>> soft);

  /// For passes that find their rows themselves: near pairs with their candidates, and all active bodies with their
  /// vertices' places, also those that meet no soft body.
  void find_all(std::span<const SoftState<Real>> soft, std::span<const std::uint8_t> active);
  /// After the bodies' `to` have changed: the candidates of what may meet now.
  void update_candidates(std::span<const SoftState<Real>> soft);
  [[nodiscard]] std::span<SurfacePair> pairs() { return pairs_; }
  [[nodiscard]] std::vector<SurfaceBody>& bodies() { return bodies_; }

  [[nodiscard]] const RowCounts& counts() const { return counts_; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  void load_meshes(std::size_t soft_count, double dt_s);
  [[nodiscard]] double bounce_m_s(const ContactRow& row, double approach_m_s);
  void load_tables(const SoftState<Real>& state, SurfaceBody& body);
  void load_ways(std::span<const SoftState<Real>> soft, std::span<const std::uint8_t> active, bool all);
  void find_pairs(std::span<const SoftState<Real>> soft);
  template <class Visit>
  void for_paired_vertices(const Visit& visit);
  void solve_velocities(double dt_s);
  void solve_places(double dt_s);
  void note(std::span<ContactNotes> notes, std::span<std::uint8_t> touched) const;
  [[nodiscard]] std::shared_ptr<const SurfaceTopology> topology_of(const std::shared_ptr<const Mesh>& mesh);

  std::vector<std::shared_ptr<const SurfaceTopology>> topologies_;  // one a mesh
  std::vector<SurfaceBody> bodies_;                                 // one a soft body, then one a mesh collider
  std::vector<Box> start_boxes_;                                    // one a soft body, where the substep finds it
  std::vector<std::uint8_t> loaded_;                                // likewise: its vertices are, in this substep
  std::vector<std::uint32_t> meeting_;                              // the bodies that meet others in this substep
  std::vector<std::uint32_t> selves_;                               // and those that meet themselves
  std::vector<std::uint32_t> seen_;                                 // and those that meet anything
  std::vector<MeshCollider> meshes_;                                // colliders; their surfaces follow the soft bodies'
  std::size_t meshes_begin_ = 0;                                    // the first of them in bodies_
  double mesh_dt_s_ = 0.0;
  double mesh_resting_m_s_ = 0.0;
  std::vector<std::optional<Vec3d>> means_m_s_;  // one a soft body that hits a mesh: its vertices' mean velocity
  std::vector<std::uint8_t> carried_;                               // one a body: by a mesh
  bool may_carry_ = false;                                          // meshes have not moved yet in this substep
  std::vector<std::uint32_t> paired_;                               // the bodies of pairs_, each once
  std::vector<SurfacePair> pairs_;                                  // near ones, sorted
  std::vector<std::pair<std::uint32_t, std::uint32_t>> near_;       // scratch
  std::vector<std::pair<std::uint32_t, std::uint32_t>> clear_;      // pairs known not to cross, sorted
  std::vector<std::pair<std::uint32_t, std::uint32_t>> crossed_;    // near ones that do, in this substep, sorted
  CandidateFinder finder_;
  MeshCandidateFinder mesh_finder_;
  std::vector<ContactRow> rows_;
  std::vector<Response> responses_;
  RowCounts counts_;
};

}  // namespace pneuma::physics
