// The inner loops of an explicit step, in SIMD lanes. One source (lane_kernel_source.h), compiled for each instruction
// set; all of them, at any width and in both layouts, do the same operations on each number in the same order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "physics/mesh/ring_pack.h"
#include "physics/state/extents.h"

namespace pneuma::physics {

/// Fleet: the lanes are `width` bodies of one mesh; slot i's component c of body w is at [(3 i + c) width + w].
/// Alone: the lanes are the slots of one body; x, y, z and a 0 of slot i are at [4 i].
enum class LaneLayout { fleet, alone };
inline constexpr std::size_t lane_layout_count = 2;

/// What a numerical method does between two evaluations of the forces; the names are those of the methods.
enum class Substage { euler, symplectic, midpoint_half, midpoint_full, rk4_first, rk4_second, rk4_third, rk4_fourth };
inline constexpr std::size_t substage_count = 8;

/// A number for each lane of the widest: one a body in a fleet, all alike for a body alone. Plain arrays here and
/// below: the kernels may call no inline function that other files share, because the linker keeps one copy of it for
/// all, whatever instructions it was compiled to.
template <class Real>
struct PerLane {
  Real lanes[pack_slots] = {};
};

/// Forces of springs and, with gas, 6 grad V at each slot of packs [begin, end), which lie in one block.
template <class Real>
struct RingPass {
  const RingPack* packs = nullptr;
  std::size_t begin = 0;
  std::size_t end = 0;
  // Of a body alone: what packs before this one need is fetched ahead. 0 where all stays in the second cache level.
  std::size_t fetch_end = 0;
  const std::uint32_t* neighbours = nullptr;      // Rings::neighbours
  const Real* lengths_m = nullptr;                // of the rest shape's edges there; see LaneKernels::slot_of_place
  const Real* stiffness_scales = nullptr;         // and of their springs; read where scaled only
  const std::uint32_t* far_neighbours = nullptr;  // Rings::far_neighbours
  const Real* x = nullptr;
  const Real* v = nullptr;  // read where damped only
  Real* force = nullptr;
  Real* gradient = nullptr;                // 6 grad V
  PerLane<Real>* volumes_18_m3 = nullptr;  // sum of (x - x_0) . 6 grad V over these packs; of a body alone in [0]
  // Of a fleet that has its springs' pulls worked out edge by edge first: RingEdges, and a number a lane for each edge.
  const std::uint32_t* edge_ends = nullptr;
  const Real* edge_lengths_m = nullptr;
  const Real* edge_stiffness_scales = nullptr;
  std::size_t edge_count = 0;
  const std::uint32_t* ring_edges = nullptr;
  Real* pulls_n_m = nullptr;  // over the edge's length
  PerLane<Real> stiffness_n_m{};
  PerLane<Real> rest_scale{};
  PerLane<Real> damping_n_s_m{};
};

/// Advances slots [begin, end) by one substage: (force + P grad V) / m + gravity on all of them.
template <class Real>
struct UpdatePass {
  std::size_t begin = 0;
  std::size_t end = 0;
  const Real* force = nullptr;
  const Real* gradient = nullptr;
  Real* x = nullptr;
  Real* v = nullptr;
  Real* move = nullptr;     // the last substage writes what x moves by here, or, where it advances, adds it to x
  Real* x_stage = nullptr;  // written by every substage but the last
  Real* v_stage = nullptr;
  Real* x_slopes = nullptr;  // RK4's sums
  Real* v_slopes = nullptr;
  Real dt_s = 0;
  Real gravity_m_s2[4] = {};  // and a 0.
  PerLane<Real> inverse_mass_1_kg{};
  PerLane<Real> pressure_sixth_pa{};
  // In and out: the largest magnitude of a component so far, one a body (of a body alone in [0]). NaN is passed over.
  PerLane<Real> v_max_m_s{};
  PerLane<Real> move_max_m{};
};

/// Brings forces on numbers [begin, end) of an array, and 6 grad V with gas, to what they would be for the same
/// acceleration of vertices of the body's mean mass. Only for bodies whose vertices are of different mass.
template <class Real>
struct WeighPass {
  std::size_t begin = 0;
  std::size_t end = 0;
  const Real* inverse_shares = nullptr;  // mean mass over the vertex's; elementwise, as all of these
  Real* force = nullptr;
  Real* gradient = nullptr;
};

/// Finds how far a body's vertices reach, as x, y, z one after the other: places, where their moves would end, and the
/// moves themselves.
template <class Real>
struct ExtentPass {
  const Real* x = nullptr;
  const Real* move = nullptr;
  const Real* v = nullptr;
  std::size_t numbers = 0;  // three a vertex
  Extents<Real>* extents = nullptr;
};

template <class Real>
struct LaneKernels {
  using Extent = void (*)(const ExtentPass<Real>&);
  using Ring = void (*)(RingPass<Real>&);
  using Weigh = void (*)(const WeighPass<Real>&);
  using Update = void (*)(UpdatePass<Real>&);

  std::size_t width = 1;
  std::size_t slots_per_ms = 1;  // about as many evaluations of the forces at a slot take a millisecond
  // RingPass::lengths_m stand in lane order: at place i of a pack's 16 stands the length of slot slot_of_place[i].
  std::array<std::uint8_t, pack_slots> slot_of_place{};
  // [layout][scaled][damped][gas]
  std::array<std::array<std::array<std::array<Ring, 2>, 2>, 2>, lane_layout_count> rings{};
  // Of fleets whose LaneMesh has edges: their pulls come first, by pulls[scaled][damped], and then the rings, by
  // pulled_rings[gas].
  std::array<std::array<Ring, 2>, 2> pulls{};
  std::array<Ring, 2> pulled_rings{};
  std::array<Weigh, 2> weighs{};  // [gas]
  Extent extents = nullptr;
  // [layout][substage][gas][advance]; advance makes a difference to the last substage of a method only.
  std::array<std::array<std::array<std::array<Update, 2>, 2>, substage_count>, lane_layout_count> updates{};

  void operator()(LaneLayout layout, bool scaled, bool damped, bool gas, RingPass<Real>& pass) const {
    rings[static_cast<std::size_t>(layout)][scaled][damped][gas](pass);
  }
  void operator()(LaneLayout layout, Substage substage, bool gas, bool advance, UpdatePass<Real>& pass) const {
    updates[static_cast<std::size_t>(layout)][static_cast<std::size_t>(substage)][gas][advance](pass);
  }
};

enum class Isa;
/// `Real` is float or double; has_isa(isa).
template <class Real>
[[nodiscard]] const LaneKernels<Real>& lane_kernels(Isa isa);
template <>
const LaneKernels<float>& lane_kernels<float>(Isa isa);
template <>
const LaneKernels<double>& lane_kernels<double>(Isa isa);

}  // namespace pneuma::physics
