// Where a soft body will be a frame from now: a few steps of its own springs, gas and planes, from its grid points and
// a velocity that both sides of a stream keep. Doubles with + - * / and square roots alone, summed in a fixed order, so
// that every implementation finds the same bits (tests/golden/simulated_motion.txt holds them to it).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/status.h"
#include "codec/grid.h"
#include "codec/lanes.h"
#include "codec/mesh_order.h"

namespace pneuma::codec {

/// The mechanics of one body, as far as a frame is predicted by them. Vertices are the mesh's.
struct Mechanics {
  /// The body stays on the side that the normal, of length 1, points to: normal . position >= offset_m.
  struct Plane {
    std::array<double, 3> normal{};
    double offset_m = 0.0;
    double restitution = 0.0;
    double friction = 0.0;
  };
  /// Its pressure at one volume; at others it goes by (volume / volume_m3)^-exponent. None where the pressure is 0.
  struct Gas {
    double pressure_pa = 0.0;
    double volume_m3 = 1.0;
    std::uint32_t exponent_65536ths = 65536;
    double outside_pa = 0.0;
  };
  double frame_s = 0.0;
  std::uint32_t substeps = 0;
  // In single precision, as they are sent.
  std::vector<float> masses_kg;        // one a vertex, or one for all; 0: of what nothing moves
  std::vector<float> rest_lengths_m;   // one of each of spring_edges()
  std::vector<float> stiffnesses_n_m;  // likewise, or one for all
  double damping_n_s_m = 0.0;
  Gas gas;
  std::array<double, 3> gravity_m_s2{};
  std::vector<Plane> planes;
};

// What every reader takes; they are part of the format, and further than a server that offers mechanics goes.
/// More than twice as many as are worth their time now (app/mechanics.cpp).
inline constexpr std::uint32_t simulated_substeps_max = 64;
/// Of a room, which has six, and some more; each is tried at every vertex.
inline constexpr std::size_t simulated_planes_max = 16;
/// Of all bodies of a stream together, of simulated_work(): about 4 ms a frame for the server, some 20 for a browser.
inline constexpr std::uint64_t simulated_work_max = 1 << 20;
/// What a frame of such a body takes, in vertices, faces and vertices held off a plane, each simulated once.
[[nodiscard]] constexpr std::uint64_t simulated_work(std::uint32_t substeps, std::size_t vertices, std::size_t faces,
                                                     std::size_t planes) {
  return std::uint64_t{substeps} * (vertices * (1 + planes) + faces);
}

/// The slots of each edge's ends, the lower first: slot by slot, the neighbours of a slot in the order of its ring.
[[nodiscard]] std::vector<std::array<std::uint32_t, 2>> spring_edges(const MeshOrder& order);

/// Velocities are whole numbers of this unit: steps of the grid a frame.
inline constexpr double velocity_unit = 0.125;

/// As they are in a list of moves: doubled, so that all are points of the grid.
inline Lanes doubled(const Lanes& velocity) {
  return {velocity.v << 1};
}
inline Lanes halved(const Lanes& move) {
  return {shifted_down(move.v, 1) & LaneVector{~0U, ~0U, ~0U, 0}};
}
/// Sets `drift` to the velocities, as such a list, that come of these moves.
inline void expect_velocities(const std::vector<Lanes>& moves, std::vector<Lanes>& drift) {
  for (std::size_t slot = 0; slot < moves.size(); ++slot) drift[slot].v = moves[slot].v << 8;
}
/// The velocities that a frame's moves amount to.
void take_for_velocities(const std::vector<Lanes>& moves, std::vector<Lanes>& velocities);

/// Not to be used by two threads at once.
class SimulatedMotion {
 public:
  /// Says what is wrong with the mechanics: lists that do not fit the mesh, numbers that are not finite (also in the
  /// units of the frame's steps) or have the wrong sign, more substeps or planes than the limits.
  [[nodiscard]] static base::Status check(const MeshOrder& order, const Mechanics& mechanics, double grid_step_m);
  /// `indices`: those that the order was made of. The mechanics have passed check().
  SimulatedMotion(std::shared_ptr<const MeshOrder> order, std::span<const std::uint32_t> indices,
                  const Mechanics& mechanics, double grid_step_m);

  /// Sets `drift` to how far each vertex will move in the next frame, in 16ths of a step. `points` and `velocities` are
  /// one a slot. A body whose simulation leaves the grid or the numbers is expected to go on as fast as it does. Takes
  /// time in proportion to substeps and vertices.
  void predict(std::span<const std::int64_t> points, const std::vector<Lanes>& velocities, std::vector<Lanes>& drift);
  /// After predict(), when the frame's moves are known: sets `velocities` to those at its end.
  void correct(const std::vector<Lanes>& moves, std::vector<Lanes>& velocities) const;

 private:
  using FourDoubles [[gnu::vector_size(32)]] = double;
  /// x, y, z of a vertex, in grid steps; the fourth is 1 for a position and 0 for any difference. Aligned for the
  /// widest registers that a clone may load it to.
  struct alignas(32) Quad {
    FourDoubles v = {0.0, 0.0, 0.0, 0.0};
  };
  /// Four edges beside each other.
  struct Springs {
    std::array<std::array<std::uint32_t, 2>, 4> ends{};
    // By (step / frame)^2 and the like: they give accelerations times masses, in steps a substep squared.
    Quad stiffness;
    Quad tension_at_rest;  // the same, times the rest length
    // Of the frame under way:
    Quad inverse_length;
    Quad length;
  };
  struct RingSprings {
    std::array<std::uint32_t, 6> first{};
  };
  struct Inertia {
    double inverse_mass = 0.0;
    double falls = 0.0;  // 1 where gravity counts
  };
  struct Plane {
    Quad normal;    // the fourth is 0
    Quad equation;  // the fourth is such that the product with a position adds up to its distance
    double offset;  // from the origin, in steps
    double restitution;
    double friction;
  };

  void begin_frame(std::span<const std::int64_t> points, const std::vector<Lanes>& velocities);
  void place_planes(std::span<const std::int64_t> points);
  void measure_edges();
  void pull_edges(double damping);
  void find_gradient();
  [[nodiscard]] double pressure_factor() const;
  void move_vertices(double pressure, double ahead);
  [[nodiscard]] bool end_frame(std::vector<Lanes>& drift);

  std::shared_ptr<const MeshOrder> order_;
  std::vector<std::array<std::uint32_t, 3>> faces_;  // by slot
  std::vector<Springs> springs_;
  std::vector<RingSprings> ring_springs_;    // by slot: the springs to the neighbours in order_->rings
  std::vector<std::uint32_t> rest_springs_;  // and to those in order_->ring_rests
  std::vector<Inertia> inertias_;            // by slot
  std::vector<Plane> planes_;
  Quad gravity_;
  double substeps_;
  double damping_;
  double gas_pressure_;  // in the unit that a sixth of the area's sum is pushed by
  double outside_;
  double six_gas_volumes_;
  std::uint32_t gas_exponent_;
  // Of the frame under way, by slot:
  std::vector<Quad> start_;
  std::vector<Quad> positions_;
  std::vector<Quad> steps_;  // the velocity, a substep
  std::vector<Quad> gradient_;
  std::vector<Quad> next_;     // after predict(): how far each moves
  std::vector<double> pulls_;  // by spring
  std::vector<Plane> near_planes_;
  // Six volumes are what the first adds up to, less the second.
  Quad volume_sums_;
  double volume_base_ = 0.0;
};

/// One a body; null: it is not simulated.
using SimulatedMotionPtr = std::shared_ptr<SimulatedMotion>;

}  // namespace pneuma::codec
