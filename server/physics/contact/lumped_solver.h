// Rows of bodies that answer by the masses of their vertices, against each other and solids, kept for some substeps.
// What a sweep needs lies side by side.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/row.h"
#include "physics/contact/solver.h"
#include "physics/contact/surface_body.h"
#include "physics/contact/sweep_kernels.h"
#include "physics/lanes/isa.h"
#include "physics/machine/line_allocator.h"

namespace pneuma::physics {

/// A rigid body in a solve.
struct LumpedRigid {
  Vec3d velocity = Vec3d::Zero();
  Vec3d angular_velocity = Vec3d::Zero();
  Vec3d shift_m = Vec3d::Zero();  // by part()
  Vec3d inverse_masses_1_kg = Vec3d::Zero();
  Eigen::Matrix3d inverse_inertia_1_kg_m2 = Eigen::Matrix3d::Zero();
};

/// Where the vertices of bodies are among the slots of a solver that loads its rows. Solvers use one in turns: between
/// loads all is 0.
struct SlotTable {
  std::vector<std::size_t> first_of;   // one a body: where its vertices begin
  std::vector<std::uint32_t> slot_of;  // one a vertex of any body: its slot and one, or 0

  void begin(std::span<const SurfaceBody> bodies);
  [[nodiscard]] std::size_t bytes() const {
    return first_of.capacity() * sizeof(std::size_t) + slot_of.capacity() * sizeof(std::uint32_t);
  }
};

class LumpedSolver {
 public:
  /// A vertex that rows name, or the point of a moving collider that a row meets: that is of no body, and the caller
  /// says how it moves. Each has a value.
  struct Slot {
    std::uint32_t body = 0;
    std::uint32_t vertex = 0;
  };
  /// One number for each of three axes and a 0, a slot.
  using Values = std::vector<double, LineAllocator<double>>;
  /// The rows that a solve is about; those against solids that do not give way come last in a sweep, and so hold.
  struct Due {
    std::vector<std::uint32_t> skins, rigid, fixed;
    void clear() {
      for (auto* list : {&skins, &rigid, &fixed}) list->clear();
    }
  };

  /// The solids that rows may name.
  struct Solids {
    std::span<const std::uint32_t> rigid;    // the rigid bodies that they do, sorted
    std::size_t rigid_count = 0;             // of all that there are
    std::span<const std::uint8_t> is_still;  // one a collider
  };
  /// Takes the rows' supports, normals, friction and impulses. Rows name `bodies` by index; what is past them is a
  /// solid, all rigid bodies first, then colliders. The table has begun with the bodies.
  void load(std::span<ContactRow* const> rows, std::span<const SurfaceBody> bodies, const Solids& solids,
            SlotTable& table);

  [[nodiscard]] std::span<const Slot> slots() const { return slots_; }
  /// One a row. The caller says what they are to reach.
  [[nodiscard]] std::span<LumpedImpulse> impulses() { return impulses_; }
  [[nodiscard]] std::span<const LumpedImpulse> impulses() const { return impulses_; }
  [[nodiscard]] Vec3d impulse_n_s(std::size_t row) const;
  /// One a rigid body that rows name. The caller says how they move, before it calls turn().
  [[nodiscard]] std::span<LumpedRigid> rigid() { return rigid_; }

  /// Where a row of a solid stands in this substep: its normal, and the point of the solid, from its centre (of a rigid
  /// body). The impulse across the normal stays across.
  void turn(std::size_t row, const Vec3d& normal, const Vec3d& arm);
  /// The shares of its vertices in a row of an edge or a face with a solid. Call turn() then.
  void share(std::size_t row, std::span<const double> weights);
  /// The row has no impulse.
  void let_go(std::size_t row) { impulses_[row] = {}; }
  /// Whether the row moves what it has of a skin.
  [[nodiscard]] bool gives_way(std::size_t row) const { return rows_[row].pushes_1_kg[0] != 0.0; }
  /// The slot of a row's vertex.
  [[nodiscard]] std::size_t corner_slot(std::size_t row, std::size_t corner) const {
    return rows_[row].corners[corner];
  }
  [[nodiscard]] Vec3d normal(std::size_t row) const { return Vec3d::Map(rows_[row].normal); }
  /// Where from its centre a row meets a rigid body, and how that point moves.
  [[nodiscard]] const Vec3d& arm(std::size_t row) const { return sides_[row - first_solid_row_].arm; }
  [[nodiscard]] Vec3d rigid_velocity_m_s(std::size_t row) const;
  /// Takes from the moves of a skin what the row's impulse made of its velocities.
  void take_back(std::size_t row, double dt_s, Values& moves_m) const {
    push_vertices(rows_[row], -dt_s * impulse_n_s(row), moves_m);
  }
  /// The slots of the vertices that its impulse acts on.
  [[nodiscard]] std::span<const std::uint32_t> pushed_slots(std::size_t row) const {
    return std::span(rows_[row].corners).first(rows_[row].pushed_count);
  }
  /// The slot of the first vertex.
  [[nodiscard]] std::size_t skin_slot(std::size_t row) const { return rows_[row].corners[0]; }
  /// The slot of the point of a moving collider.
  [[nodiscard]] std::size_t point_slot(std::size_t row) const { return sides_[row - first_solid_row_].slot; }

  /// The first support's value as seen from the second; not of a row with a solid.
  [[nodiscard]] Vec3d value(std::size_t row, const Values& values) const { return at_vertices(rows_[row], values); }
  /// The value of what a row of a solid has of a skin.
  [[nodiscard]] Vec3d at_skin(std::size_t row, const Values& values) const;
  /// Sets along[i] to the value of each of the first `count` rows along its normal.
  void project(const Values& values, std::size_t count, std::span<double> along) const;

  /// Adds what the impulses that the rows hold make of the velocities.
  void push(Values& velocities_m_s);
  /// Changes the velocities by impulses of the rows that are due, from those that they hold.
  SolveOutcome solve(const Due& due, const SolveLimits& limits, Values& velocities_m_s);
  /// Brings the moves of rows that are due to `least_m` along their normals, in one sweep without friction. The
  /// impulses that the rows hold stay as they are.
  void part(const Due& due, std::span<const double> least_m, Values& moves_m);

  [[nodiscard]] std::size_t bytes() const;

 private:
  static constexpr std::uint32_t none = 0xffff'ffff;
  // Of a row against a solid.
  struct SolidSide {
    std::uint32_t rigid = none;
    std::uint32_t slot = none;            // of its point, of a moving collider
    double skin_inverse_mass_1_kg = 0.0;  // of the row's other side
    Vec3d corner_inverse_masses_1_kg = Vec3d::Zero();
    Vec3d arm = Vec3d::Zero();
  };

  [[nodiscard]] std::uint32_t slot_of(std::uint32_t body, std::uint32_t vertex, SlotTable& table);
  [[nodiscard]] Vec3d at_vertices(const LumpedRow& row, const Values& values) const;
  void push_vertices(const LumpedRow& row, const Vec3d& impulse_n_s, Values& values) const;
  void push_rigid(const SolidSide& side, const Vec3d& impulse_n_s);
  [[nodiscard]] double sweep_rigid(std::span<const std::uint32_t> due, Values& velocities_m_s);
  void part_rigid(std::span<const std::uint32_t> due, std::span<const double> least_m, Values& moves_m);

  const SweepKernels* kernels_ = &sweep_kernels(isa_in_use());
  std::vector<Slot> slots_;
  std::vector<LumpedRow> rows_;
  std::size_t first_solid_row_ = 0;  // rows of solids come last
  std::vector<SolidSide> sides_;     // theirs
  std::vector<LumpedRigid> rigid_;
  std::vector<LumpedImpulse> impulses_;
  std::vector<LumpedImpulse> parting_;  // scratch of part()
};

// Here, since each row asks several times a substep.
inline Vec3d LumpedSolver::at_skin(std::size_t index, const Values& values) const {
  const LumpedRow& row = rows_[index];
  Vec3d sum = row.weights[0] * Vec3d::Map(values.data() + std::size_t{4} * row.corners[0]);
  for (std::size_t i = 1; i < row.pushed_count; ++i) {
    sum += row.weights[i] * Vec3d::Map(values.data() + std::size_t{4} * row.corners[i]);
  }
  return sum;
}

}  // namespace pneuma::physics
