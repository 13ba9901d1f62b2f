// The impulses of contacts: at each row no approach past its gap, no pull, and friction within Coulomb's cone.
#pragma once

#include <cstdint>
#include <span>

#include "physics/contact/response.h"
#include "physics/contact/row.h"

namespace pneuma::physics {

struct SolveLimits {
  std::uint32_t sweeps_max = 16;
  /// A sweep that changes no row's velocity by more is the last; the first ones end at a hundredth of it where rows may
  /// be solved together.
  double enough_m_s = 0.0;
  /// Where the sweeps do not get there, up to so many loaded rows are solved together. 0: never.
  std::size_t direct_rows_max = 0;
  /// What those may be off by, if more than enough_m_s.
  double direct_enough_m_s = 0.0;
};

struct SolveOutcome {
  std::uint32_t sweeps = 0;
  std::uint32_t factorisations = 0;
  bool converged = true;
  double off_m_s = 0.0;  // by which the last look at the rows changed a velocity
};

/// Block Gauss-Seidel in the order of the rows, from the impulses that they hold. A row's two supports may be of one
/// body. Bodies that no chain of rows ties together do not touch each other's results, but for who ends first.
///
/// The rows of a stiff body under load all pull at nearly one number, and sweeps stall there: 30 of them carried 58 %
/// of a weight. A program of the loaded rows takes over then (friction_program.h).
SolveOutcome solve_rows(std::span<ContactRow> rows, std::span<Response> responses, const SolveLimits& limits);

}  // namespace pneuma::physics
