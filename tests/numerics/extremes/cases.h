// The extreme cases by what they strain; extreme_cases() has them all.
#pragma once

#include <vector>

#include "numerics/extremes/extreme_case.h"

namespace pneuma::extremes {

[[nodiscard]] std::vector<ExtremeCase> stiff_cases();
[[nodiscard]] std::vector<ExtremeCase> gas_cases();
[[nodiscard]] std::vector<ExtremeCase> shape_cases();
[[nodiscard]] std::vector<ExtremeCase> scale_cases();
[[nodiscard]] std::vector<ExtremeCase> input_cases();
[[nodiscard]] std::vector<ExtremeCase> contact_cases();
[[nodiscard]] std::vector<ExtremeCase> meeting_cases();
[[nodiscard]] std::vector<ExtremeCase> endurance_cases();

}  // namespace pneuma::extremes
