// An explicit step of soft bodies through the lane kernels: bodies of one mesh abreast, or a body alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <vector>

#include "physics/forces.h"
#include "physics/lane_kernels.h"
#include "physics/ring.h"
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
  LaneArray<Real> gradient;  // with gas only
  LaneArray<Real> pulls;     // of fleets with LaneMesh::edges only
  LaneArray<Real> move;      // not where x is advanced
  LaneArray<Real> x_stage;   // midpoint and RK4 only
  LaneArray<Real> v_stage;
  LaneArray<Real> x_slopes;  // RK4 only
  LaneArray<Real> v_slopes;
  std::vector<PerLane<Real>, LineAllocator<PerLane<Real>>> block_volumes;
  std::vector<PerLane<Real>, LineAllocator<PerLane<Real>>> block_maxima;  // of a body that threads share only
  std::vector<std::uint32_t> pinned_slots;
  // For forces that the kernels do not know, in the mesh's order of vertices.
  std::vector<Vec3<Real>> other_x;
  std::vector<Vec3<Real>> other_v;
  std::vector<Vec3<Real>> other_force;

  [[nodiscard]] std::size_t bytes() const;
};

struct LaneSettings {
  Integrator integrator = Integrator::midpoint;
  Surroundings surroundings;
  double dt_s = 0.0;
};

/// Whether the kernels measure the body's volume and spread its pressure: exactly, and by faces.
[[nodiscard]] bool has_lane_gas(const SoftBody& body, const Rings& rings);
/// Whether the body has forces that the kernels do not know: bending, wind, grabs, gas by another method. Such a body
/// steps alone.
template <class Real>
[[nodiscard]] bool has_other_forces(const SoftState<Real>& body, const Rings& rings, const Atmosphere& atmosphere);

/// One substep of one body, up to contact: its gas advances (advance_gas), v advances by dt_s, dr is the move that
/// belongs to it, and x stays. `workers` may be null; where the body is large they share it.
template <class Real>
void step_alone(SoftState<Real>& body, const LaneMesh<Real>& mesh, const LaneKernels<Real>& kernels,
                const LaneSettings& settings, LaneScratch<Real>& scratch, Workers* workers, Profile* profile);

/// As many substeps, x included, of bodies that touch nothing: up to kernels.width of one mesh, all with lane gas or
/// all without, all damped or none, the same vertices pinned; or a single one. Sets `done[i]` where the i-th body has
/// surely stayed within the limits all the way, and
/// its gas just flowed; the others are left as they were, dr aside.
template <class Real>
void step_freely(std::span<SoftState<Real>* const> bodies, const LaneMesh<Real>& mesh, const LaneKernels<Real>& kernels,
                 const LaneSettings& settings, std::uint32_t substeps, LaneScratch<Real>& scratch, Workers* workers,
                 Profile* profile, std::span<std::uint8_t> done);

}  // namespace pneuma::physics
