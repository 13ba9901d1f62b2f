// Colliders that are meshes: surfaces behind those of the soft bodies, which do not give way.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "physics/contact/candidates.h"
#include "physics/contact/row.h"
#include "physics/contact/surface_body.h"
#include "physics/mesh/mesh_tree.h"
#include "physics/scene/shape.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// A mesh collider in the substep under way.
struct MeshCollider {
  std::uint32_t index = 0;  // among the colliders
  std::shared_ptr<const MeshTree> tree;
  Surface surface;
  bool moves = false;
  Frame start;
  Frame end;

  /// Where what is at `place` would be if it went with the collider.
  [[nodiscard]] Vec3d carried(const Vec3d& place) const { return end.to_world(start.to_local(place)); }
};

/// Lists those of the colliders that are meshes, and how they go through dt_s.
void find_mesh_colliders(std::span<const ColliderState> colliders, double dt_s, std::vector<MeshCollider>& meshes);

/// Sets the surface of a collider, as it goes through the substep. One that does not move is set once.
void load_surface(const MeshCollider& mesh, std::shared_ptr<const SurfaceTopology> topology, SurfaceBody& body);

/// Finds the candidates of a soft body, first in the pair, and a mesh collider, by the mesh's own tree.
class MeshCandidateFinder {
 public:
  /// See CandidateFinder.
  void allow(std::size_t looks) { finder_.allow(looks); }
  [[nodiscard]] std::size_t looks_left() const { return finder_.looks_left(); }

  void find(const MeshCollider& mesh, SurfacePair& pair, std::span<const SurfaceBody> bodies);
  [[nodiscard]] std::size_t bytes() const {
    return finder_.bytes() + (near_soft_.capacity() + near_mesh_.capacity()) * sizeof(CandidateFinder::FaceBox);
  }

 private:
  CandidateFinder finder_;
  std::vector<CandidateFinder::FaceBox> near_soft_, near_mesh_;
};

/// Appends a row for each vertex of soft body `first` that is in the collider, a closed mesh and surface `second`, or
/// would come to it: it goes out by the nearest way, and stays there. For a body that was put across it; an open mesh
/// has no inside.
void find_ways_out(const MeshCollider& mesh, std::uint32_t first, std::uint32_t second,
                   std::span<const SurfaceBody> bodies, std::vector<ContactRow>& rows);

/// Whether find_ways_out made the row.
[[nodiscard]] bool is_way_out(const ContactRow& row);

/// Lets the soft bodies that touch a moving mesh, and those that these touch, begin the substep where it would carry
/// them: from there on the mesh stands still, so a cut of their moves ends nowhere across it. Sets `carried`, one a
/// body. What touches other meshes too stays, since no one place is safe for it. (Meshes are those from `meshes_begin`
/// on.)
void carry_with_meshes(std::span<const SurfacePair> pairs, std::span<const MeshCollider> meshes,
                       std::size_t meshes_begin, std::span<SurfaceBody> bodies, std::vector<std::uint8_t>& carried);

}  // namespace pneuma::physics
