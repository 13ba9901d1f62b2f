// Work-precision diagrams.
#pragma once

#include <vector>

#include "numerics/report/plot.h"
#include "numerics/report/precision_runs.h"

namespace pneuma::report::precision {

/// Error against time of every method's ladder; what failed stands on the upper edge.
[[nodiscard]] Plot diagram(const Measured& measured, const Judged& judged);

/// RK4's ladders in both precisions, of the cases that have them.
[[nodiscard]] Plot precision_diagram(const std::vector<Measured>& all);

}  // namespace pneuma::report::precision
