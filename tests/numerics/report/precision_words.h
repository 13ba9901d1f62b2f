// The numbers of the work-precision part as sentences and tables.
#pragma once

#include <vector>

#include "numerics/report/part.h"
#include "numerics/report/precision_hindsight.h"

namespace pneuma::report::precision {

/// Which method for which scene, and how AUTO did.
void write_advice(Page& page, const std::vector<Verdict>& rows);
/// AUTO's choices against the best in hindsight; the cheapest for 1 % and 0.1 %.
void write_verdicts(Page& page, const std::vector<Verdict>& rows);
/// What else is measured: volume, energy, momenta, period; what Newton's iterations do.
void write_measures(Page& page, const std::vector<Measured>& all);
/// The balls at rest beside Bullet's.
void write_peers(Page& page, const std::vector<Measured>& all);
/// How far the references can be trusted.
void write_references(Page& page, const std::vector<Measured>& all);

}  // namespace pneuma::report::precision
