// Implicit (backward) Euler: order 1, stable at any step, damps what it does not resolve.
#pragma once

#include "physics/implicit/implicit_solver.h"

namespace pneuma::physics {

/// Where the solve starts: by the velocities as they are, or with their turning made a turn. Straight on, a stiff body
/// that turns far in a step begins it stretched.
enum class FirstGuess { straight, turned };

/// Gives the velocities of places x that end a step with the body turned where straight ways would stretch it.
template <class Real>
void turn_straight_ways(const SoftState<Real>& body, std::span<const Vec3d> x, double dt_s, std::vector<Vec3d>& u);

/// Advances body.v and sets body.dr, as solve_step() does. With one Newton iteration it is the linearised method of
/// Baraff and Witkin, "Large Steps in Cloth Simulation" (1998). False, and the body unmoved, where the solve failed.
template <class Real>
[[nodiscard]] bool implicit_euler(SoftState<Real>& body, ImplicitTables<Real>& tables, const StageAccuracy& accuracy,
                                  const SubstepContext& context, FirstGuess guess, ImplicitSolver<Real>& solver);

/// The same for a body whose own method is another, with a matrix of its own: from a turned guess where nothing holds
/// the body.
template <class Real>
[[nodiscard]] bool euler_again(SoftState<Real>& body, ImplicitTables<Real>& tables, const StageAccuracy& accuracy,
                               const SubstepContext& context, ImplicitSolver<Real>& solver);

}  // namespace pneuma::physics
