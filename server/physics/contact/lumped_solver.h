// The sweeps of solve_rows (solver.h) for bodies that all answer by the masses of their vertices: what a row needs lies
// side by side.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/row.h"
#include "physics/contact/solver.h"
#include "physics/contact/surface_body.h"

namespace pneuma::physics {

class LumpedSolver {
 public:
  /// Takes the rows' supports, normals and friction; the rows name the bodies by index.
  void load(std::span<const ContactRow> rows, std::span<const SurfaceBody> bodies);

  /// Finds the rows' impulses, from those that they hold, for their free and least velocities. The rows are those of
  /// the last load. `with_friction`: false leaves it out.
  SolveOutcome solve(std::span<ContactRow> rows, const SolveLimits& limits, bool with_friction);

  /// Calls visit(body, vertex, change in m/s) for each vertex of a row, in the order of the rows, once each.
  template <class Visit>
  void for_changes(const Visit& visit) const {
    for (const Slot& slot : slots_) visit(slot.body, slot.vertex, Vec3d(slot.change_m_s.template head<3>()));
  }

  [[nodiscard]] std::size_t bytes() const {
    return slots_.capacity() * sizeof(Slot) + rows_.capacity() * sizeof(Row) +
           slot_of_.capacity() * sizeof(std::uint32_t);
  }

 private:
  struct Slot {
    Eigen::Vector4d change_m_s = Eigen::Vector4d::Zero();  // the fourth is 0
    std::uint32_t body = 0;
    std::uint32_t vertex = 0;
  };
  struct Row {
    Eigen::Vector4d normal = Eigen::Vector4d::Zero();
    Eigen::Vector4d free_m_s = Eigen::Vector4d::Zero();
    Eigen::Vector4d impulse_n_s = Eigen::Vector4d::Zero();
    std::array<double, 4> weights{};       // of each corner's velocity in the relative one
    std::array<double, 4> pushes_1_kg{};   // of the impulse in each corner's velocity
    std::array<std::uint32_t, 4> slots{};  // without a share: the first one, with weight 0
    double inverse_mass_1_kg = 0.0;
    double least_m_s = 0.0;
    double friction = 0.0;
  };

  [[nodiscard]] std::uint32_t slot_of(std::uint32_t body, std::uint32_t vertex);
  void push(const Row& row, const Eigen::Vector4d& impulse_n_s);
  double answer(Row& row, bool with_friction);

  std::vector<Slot> slots_;
  std::vector<Row> rows_;
  std::vector<std::size_t> first_of_;   // one a body: where its vertices begin in slot_of_
  std::vector<std::uint32_t> slot_of_;  // one a vertex of any body: its slot and one, or 0
};

}  // namespace pneuma::physics
