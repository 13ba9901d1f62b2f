// Colliders within an implicit step: the body answers, as a whole and in the same step, to the vertices that are
// stopped. Stopped afterwards (contact.h), they would leave the rest to run on into them for a step, and stiff springs
// turn that into energy that was never there.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "physics/contact/contact_limit.h"
#include "physics/contact/contact_solid.h"
#include "physics/implicit/implicit_solver.h"

namespace pneuma::physics {

/// Room for one body at a time.
template <class Real>
class ImplicitContact {
 public:
  /// ContactLimit::limit_step().
  void limit_step(SoftState<Real>& body, std::span<const Vec3<Real>> start_m_s, const Surroundings& surroundings,
                  double dt_s);

  /// Replaces the body's step (v and dr), where it runs into a collider, by the implicit Euler step in which no vertex
  /// ends behind one: surfaces push and do not pull, and rub by Coulomb's law. `start_m_s`: the velocities before the
  /// step. An active set: vertices that would go in are held, those that are pulled are let go, until none changes.
  /// `notes`: null, or where the vertices that are held are appended.
  void meet_colliders(SoftState<Real>& body, std::span<const Vec3<Real>> start_m_s, ImplicitTables<Real>& tables,
                      const StageAccuracy& accuracy, const Surroundings& surroundings,
                      std::span<const SolidMove> colliders, double dt_s, ImplicitSolver<Real>& solver,
                      ContactNotes* notes, Profile* profile);

  [[nodiscard]] std::size_t bytes() const;

 private:
  /// A vertex at the surfaces of one or more colliders.
  struct Touch {
    static constexpr std::size_t stops_max = 3;  // they leave it no way to go
    std::uint32_t vertex = 0;
    std::size_t stop_count = 0;
    std::array<VertexStop, stops_max> all_stops{};
    bool sticks = false;
    Vec3d friction_n_s = Vec3d::Zero();  // while it slides

    [[nodiscard]] std::span<const VertexStop> stops() const { return {all_stops.data(), stop_count}; }
  };

  bool add_new_stops();
  [[nodiscard]] Hold hold_of(const Touch& touch) const;
  bool follow_reactions(const ImplicitSolver<Real>& solver, bool may_slide);
  // Gives what is touched the velocities after the hit; returns the work that the surfaces did, J.
  double rebound(SoftState<Real>& body, const ImplicitSolver<Real>& solver) const;

  ContactLimit<Real> limit_;
  std::vector<VertexStop> stops_;
  std::vector<Touch> touches_;  // by vertex
  std::vector<Hold> holds_;     // of the touches
  std::vector<Vec3d> x_, u0_, pushed_, u_;
};

}  // namespace pneuma::physics
