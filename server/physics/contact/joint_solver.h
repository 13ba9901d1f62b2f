// The impulses of joints alone, all of a group at once.
#pragma once

#include <span>

#include "physics/contact/response.h"
#include "physics/contact/row.h"
#include "physics/contact/solver.h"

namespace pneuma::physics {

/// Solves rows of joints exactly, by one sparse factorisation: a chain costs what its links cost, whatever hangs at its
/// end, where sweeps would need as many as the square of its length times the ratio of its masses. Ropes that are slack
/// drop out, by an active set. A joint that would take more than it can takes that much, and is_given.
SolveOutcome solve_joint_rows(std::span<ContactRow> rows, std::span<Response> responses, double enough_m_s);

}  // namespace pneuma::physics
