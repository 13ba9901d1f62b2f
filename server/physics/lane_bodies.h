// Soft bodies in the lanes of an explicit step: where their numbers stand there, and the way in and out.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <new>
#include <span>
#include <vector>

#include "physics/lane_kernels.h"
#include "physics/ring.h"
#include "physics/state.h"
#include "physics/workers.h"

namespace pneuma::physics {

/// What the lanes of one mesh's bodies share, of those with one vertex_stiffness_scale.
template <class Real>
struct LaneMesh {
  Rings rings;
  std::vector<Real> lengths_m;                 // ring_lengths_m
  std::vector<Real> stiffness_scales;          // of the edges, along_rings; empty where all are 1
  std::vector<double> vertex_stiffness_scale;  // which these are of
  RingEdges<Real> edges;                       // for fleets of kernels with edges_first; otherwise empty

  [[nodiscard]] std::size_t bytes() const;
};

/// Puts an array at the start of a cache line, so that no load of a lane crosses one.
template <class T>
struct LineAllocator {
  using value_type = T;
  static constexpr std::align_val_t line{64};

  LineAllocator() = default;
  template <class U>
  explicit LineAllocator(const LineAllocator<U>&) {}
  [[nodiscard]] T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), line)); }
  void deallocate(T* at, std::size_t) { ::operator delete(at, line); }
  bool operator==(const LineAllocator&) const = default;
};
template <class Real>
using LaneArray = std::vector<Real, LineAllocator<Real>>;

/// Room for the bodies under way; one a thread, kept between substeps. Holds only what the bodies and the method need.
template <class Real>
struct LaneScratch {
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
  std::vector<PerLane<Real>, LineAllocator<PerLane<Real>>> block_maxima;  // of a body that threads share only
  std::vector<PerLane<std::int32_t>> block_outside;  // which places of a row of pack_slots have left the bounds
  std::vector<std::uint32_t> pinned_slots;
  // For forces that the kernels do not know, in the mesh's order of vertices.
  std::vector<Vec3<Real>> other_x;
  std::vector<Vec3<Real>> other_v;
  std::vector<Vec3<Real>> other_force;

  [[nodiscard]] std::size_t bytes() const;
};

/// Bodies of one mesh in one layout. The mesh's packs are cut into blocks, by which threads share a body.
template <class Real>
class LaneBodies {
 public:
  /// `width` bodies abreast. `workers` may be null; it is for a body alone.
  LaneBodies(std::span<SoftState<Real>* const> bodies, LaneLayout layout, std::size_t width, const LaneMesh<Real>& mesh,
             LaneScratch<Real>& scratch, Workers* workers)
      : bodies_(bodies), layout_(layout), width_(width), mesh_(mesh), scratch_(scratch), workers_(workers) {}

  /// Copies x and v into the lanes, for which there is room, and the mass shares where bodies have them; clears what
  /// the ring pass leaves out.
  void load(bool gas, bool weighed) const;
  /// Hands back the bodies that `wanted` has: v, and x, or, where x did not `advance`, the move.
  void store(std::span<const std::uint8_t> wanted, bool advance) const;
  /// Sets well[lane] where all substeps kept a body within what freezes it (is_well in simulation.cpp), by bounds that
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

  [[nodiscard]] std::size_t slot_count() const { return mesh_.rings.slot_count(); }
  [[nodiscard]] std::size_t at(std::size_t slot, std::size_t component, std::size_t lane) const {
    return layout_ == LaneLayout::fleet ? (3 * slot + component) * width_ + lane : 4 * slot + component;
  }
  [[nodiscard]] std::size_t block_count() const { return (mesh_.rings.packs.size() + block_packs - 1) / block_packs; }
  [[nodiscard]] std::size_t packs_end(std::size_t block) const {
    return std::min((block + 1) * block_packs, mesh_.rings.packs.size());
  }
  [[nodiscard]] std::size_t slots_begin(std::size_t block) const { return block * block_packs * pack_slots; }
  [[nodiscard]] std::size_t slots_end(std::size_t block) const { return packs_end(block) * pack_slots; }
  /// Calls work(block) for each, on as many threads as the body is shared among.
  template <class Work>
  void for_blocks(const Work& work) const {
    if (workers_ != nullptr) return workers_->for_each(block_count(), std::cref(work));
    for (std::size_t block = 0; block < block_count(); ++block) work(block);
  }

 private:
  void load_alone(std::size_t block) const;
  void load_shares(std::size_t block) const;
  void store_alone(bool advance) const;
  void clear_unused_slots(LaneArray<Real>& array) const;
  void find_outside(std::size_t block, const std::array<Real, pack_slots>& reach_max, Real speed_max) const;

  std::span<SoftState<Real>* const> bodies_;
  LaneLayout layout_;
  std::size_t width_;
  const LaneMesh<Real>& mesh_;
  LaneScratch<Real>& scratch_;
  Workers* workers_;
};

}  // namespace pneuma::physics
