// Bounces, and ways out of overlaps, that give no energy.
#pragma once

#include <span>

#include "physics/contact/response.h"
#include "physics/contact/row.h"
#include "physics/contact/solver.h"

namespace pneuma::physics {

/// What the impulses that rows hold did to the energy of their bodies, over the work of those that are driven.
[[nodiscard]] double gained_j(std::span<const ContactRow> rows, std::span<const Response> responses);

struct GainLimit {
  double allowed_j = 0.0;
  double share = 1.0;  // of the largest blend that keeps to it
};

/// Where rows that bounce gave more energy than is allowed, blends their solution with the one without a bounce, in
/// which each row reaches its `still_m_s`. Newton's law of restitution gives energy where friction turns a body into
/// its contact (Kane and Levinson, "Dynamics: Theory and Applications", 1985). Returns whether what it had to solve has
/// converged.
bool limit_bounce(std::span<ContactRow> rows, std::span<Response> responses, std::span<const double> still_m_s,
                  const GainLimit& gain, const SolveLimits& limits);

/// The same of rows that are to part where they overlap. Each may give what parts it alone. Rows that are to part
/// against each other have no solution, or one without bounds.
bool limit_parting(std::span<ContactRow> rows, std::span<Response> responses, const SolveLimits& limits);

}  // namespace pneuma::physics
