// Soft bodies in the lanes of an explicit step: where their numbers stand there, and the way in and out.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "physics/lanes/lane_kernels.h"
#include "physics/machine/line_allocator.h"
#include "physics/mesh/ring.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// What the lanes of one mesh's bodies share, of those with one vertex_stiffness_scale.
template <class Real>
struct LaneMesh {
  Rings rings;
  std::vector<Real> lengths_m;                 // ring_lengths_m
  std::vector<Real> stiffness_scales;          // of the edges, along_rings; empty where the body has no factors
  std::vector<double> vertex_stiffness_scale;  // which these are of
  RingEdges<Real> edges;                       // of fleets where the pulls come first; otherwise empty

  [[nodiscard]] std::size_t bytes() const;
};

template <class Real>
using LaneArray = std::vector<Real, LineAllocator<Real>>;

template <class Real>
class LaneTeam;

/// Room for the bodies under way; one a thread, kept between substeps. Holds only what the bodies and the method need.
template <class Real>
struct LaneScratch {
  LaneScratch();
  ~LaneScratch();
  LaneScratch(const LaneScratch&);  // room is not shared: a copy has none yet
  LaneScratch& operator=(const LaneScratch&) = delete;
  LaneScratch(LaneScratch&&) noexcept;
  LaneScratch& operator=(LaneScratch&&) noexcept;

  LaneArray<Real> x;
  LaneArray<Real> v;
  LaneArray<Real> force;
  LaneArray<Real> gradient;        // with gas only
  LaneArray<Real> inverse_shares;  // WeighPass; of vertices of different mass only
  LaneArray<Real> pulls;           // of fleets with LaneMesh::edges only
  LaneArray<Real> move;            // not where x is advanced
  LaneArray<Real> x_stage;         // midpoint and RK4 only
  LaneArray<Real> v_stage;
  LaneArray<Real> x_slopes;  // RK4 only
  LaneArray<Real> v_slopes;
  std::vector<PerLane<Real>, LineAllocator<PerLane<Real>>> block_volumes;
  std::vector<std::uint32_t> pinned_slots;
  // For forces that the kernels do not know, in the mesh's order of vertices.
  std::vector<Vec3<Real>> other_x;
  std::vector<Vec3<Real>> other_v;
  std::vector<Vec3<Real>> other_force;
  // Of the last body that threads shared: the others' room. Its rings must outlive it.
  std::unique_ptr<LaneTeam<Real>> team;

  [[nodiscard]] std::size_t bytes() const;
};

/// The room of each thread. Worlds may use it in turns (machine/room_pool.h) while no team is in it.
template <class Real>
struct LaneRooms {
  std::vector<LaneScratch<Real>> of_threads;

  /// For at least so many threads.
  [[nodiscard]] std::vector<LaneScratch<Real>>& at_least(std::size_t threads) {
    if (of_threads.size() < threads) of_threads.resize(threads);
    return of_threads;
  }
  [[nodiscard]] std::size_t bytes() const;
  [[nodiscard]] bool has_team() const;
  void clear() {}
};

/// Writes x, y, z, 0 of a slot of a body alone: whole rows, which the first pass loads as such.
template <class Real>
void put_row(const Vec3<Real>& from, LaneArray<Real>& to, std::size_t slot) {
  const std::array<Real, 4> numbers{from.x(), from.y(), from.z(), Real{0}};
  std::ranges::copy(numbers, to.data() + 4 * slot);
}

[[nodiscard]] inline std::size_t block_count_of(const Rings& rings) {
  return (rings.packs.size() + block_packs - 1) / block_packs;
}

/// Blocks [begin, end).
struct BlockRun {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Bodies of one mesh in one layout, or a run of one body's blocks.
template <class Real>
class LaneBodies {
 public:
  /// `width` bodies abreast.
  LaneBodies(std::span<SoftState<Real>* const> bodies, LaneLayout layout, std::size_t width, const LaneMesh<Real>& mesh,
             LaneScratch<Real>& scratch, BlockRun blocks)
      : bodies_(bodies), layout_(layout), width_(width), mesh_(mesh), scratch_(scratch), blocks_(blocks) {}

  /// Copies x and v into the lanes, for which there is room, and the mass shares where bodies have them; clears what
  /// the ring pass leaves out.
  void load(bool gas, bool weighed) const;
  /// Hands back the bodies that `wanted` has: v, and x, or, where x did not `advance`, the move.
  void store(std::span<const std::uint8_t> wanted, bool advance) const;
  /// Sets well[lane] where all substeps kept a body within what freezes it (is_well in runaway.h), by bounds that
  /// need no look at each vertex in each substep: the largest components of velocity and move, and where it ended. What
  /// once is not a number stays so to the end.
  void find_well(std::uint32_t substeps, const PerLane<Real>& v_max_m_s, const PerLane<Real>& move_max_m,
                 std::span<std::uint8_t> well) const;

  [[nodiscard]] std::size_t size() const { return bodies_.size(); }
  [[nodiscard]] SoftState<Real>& operator[](std::size_t lane) const { return *bodies_[lane]; }
  /// Lanes past the last body do as it does.
  [[nodiscard]] const SoftState<Real>& of_lane(std::size_t lane) const {
    return *bodies_[std::min(lane, bodies_.size() - 1)];
  }
  /// Calls visit(slot, vertex) for each slot in use.
  template <class Visit>
  void for_slots(const Visit& visit) const {
    for (std::size_t p = packs_begin(); p < packs_end(); ++p) {
      for (std::size_t slot = p * pack_slots; slot < p * pack_slots + mesh_.rings.packs[p].count; ++slot) {
        visit(slot, mesh_.rings.vertices[slot]);
      }
    }
  }

  [[nodiscard]] std::size_t at(std::size_t slot, std::size_t component, std::size_t lane) const {
    return layout_ == LaneLayout::fleet ? (3 * slot + component) * width_ + lane : 4 * slot + component;
  }
  [[nodiscard]] BlockRun blocks() const { return blocks_; }
  [[nodiscard]] std::size_t packs_begin() const { return blocks_.begin * block_packs; }
  [[nodiscard]] std::size_t packs_end() const { return std::min(blocks_.end * block_packs, mesh_.rings.packs.size()); }
  [[nodiscard]] std::size_t slots_begin() const { return packs_begin() * pack_slots; }
  [[nodiscard]] std::size_t slots_end() const { return packs_end() * pack_slots; }

 private:
  void load_shares() const;
  void clear_unused_slots(LaneArray<Real>& array) const;

  std::span<SoftState<Real>* const> bodies_;
  LaneLayout layout_;
  std::size_t width_;
  const LaneMesh<Real>& mesh_;
  LaneScratch<Real>& scratch_;
  BlockRun blocks_;
};

}  // namespace pneuma::physics
