#include "numerics/extremes/extreme_case.h"

#include <algorithm>

#include "numerics/extremes/cases.h"

namespace pneuma::extremes {
namespace {

std::vector<ExtremeCase> in_order(const std::vector<std::vector<ExtremeCase>>& groups) {
  std::vector<ExtremeCase> all;
  for (const std::vector<ExtremeCase>& group : groups) all.insert(all.end(), group.begin(), group.end());
  std::ranges::sort(all, {}, &ExtremeCase::number);
  return all;
}

}  // namespace

const std::vector<ExtremeCase>& extreme_cases() {
  static const std::vector<ExtremeCase> all = in_order(
      {stiff_cases(), gas_cases(), shape_cases(), scale_cases(), input_cases(), contact_cases(), endurance_cases()});
  return all;
}

std::string scene_path(const std::string& file) {
  return std::string(PNEUMA_EXTREME_SCENES "/").append(file);
}

}  // namespace pneuma::extremes
