// The one order in which a soft body's forces and sums are added up, on every path: each vertex takes its neighbours in
// cyclic order, and a body takes its vertices by slots.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/mesh/mesh.h"
#include "physics/mesh/ring_pack.h"

namespace pneuma::physics {

/// A mesh's vertices in slots: close ones close together (by the Morton order of their rest positions), sorted by
/// degree within windows.
struct Rings {
  std::vector<RingPack> packs;
  std::vector<std::uint32_t> vertices;  // one a slot
  std::vector<std::uint32_t> slots;     // one a vertex: the slot in use
  // Four times the slot of the neighbour at place s of the ring of slot i in a pack: [first + s * pack_slots + i].
  // Four, because that is where its coordinates are in an array of x, y, z, 0. At a border the ring is a fan, from one
  // end to the other.
  std::vector<std::uint32_t> neighbours;
  // Of them, once a pack, those that a walk over the slots in order does not come near: they have to be fetched ahead.
  std::vector<std::uint32_t> far_neighbours;
  // Every ring is one closed fan, so that sum d_j x d_(j+1) over it is 6 grad V.
  bool encloses = false;

  [[nodiscard]] std::size_t slot_count() const { return vertices.size(); }
};

[[nodiscard]] Rings make_rings(const Mesh& mesh);

/// The edges once each, for a fleet that works out each spring's pull once and has both ends read it.
template <class Real>
struct RingEdges {
  std::vector<std::uint32_t> ends;     // two slots an edge, in the order in which the rings first come by
  std::vector<Real> lengths_m;         // of the rest shape, one an edge
  std::vector<Real> stiffness_scales;  // one an edge; empty where the body has no factors
  std::vector<std::uint32_t> of_ring;  // the edge to the neighbour, one an entry of Rings::neighbours
};

/// `stiffness_scales` has one for each of the mesh's edges, or none.
template <class Real>
[[nodiscard]] RingEdges<Real> make_ring_edges(const Mesh& mesh, const Rings& rings,
                                              std::span<const double> stiffness_scales = {});

/// What each edge of the mesh has in `of_edges`, along each ring. The numbers of a pack's 16 slots at one place of the
/// ring stand in the order of `slot_of_place`.
template <class Real>
[[nodiscard]] std::vector<Real> along_rings(const Mesh& mesh, const Rings& rings, std::span<const double> of_edges,
                                            const std::array<std::uint8_t, pack_slots>& slot_of_place);
/// The like of the lengths of the rest shape's edges.
template <class Real>
[[nodiscard]] std::vector<Real> ring_lengths_m(const Mesh& mesh, const Rings& rings,
                                               const std::array<std::uint8_t, pack_slots>& slot_of_place);

}  // namespace pneuma::physics
