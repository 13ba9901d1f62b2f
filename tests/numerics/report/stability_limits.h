// The step at which each explicit integrator becomes unstable, found by bisection, beside what theory says.
#pragma once

#include "numerics/report/linear_ball.h"
#include "numerics/report/part.h"

namespace pneuma::report {

/// Adds a subsection: a table, a figure with and one without damping, and an outcome a limit. Its progress goes from
/// `begun` to `ended`.
void add_stability_limits(Context& context, const LinearBall& ball, double begun, double ended);

}  // namespace pneuma::report
