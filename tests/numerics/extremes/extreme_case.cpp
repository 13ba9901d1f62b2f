#include "numerics/extremes/extreme_case.h"

#include <algorithm>
#include <iterator>

#include "numerics/extremes/cases.h"

namespace pneuma::extremes {

namespace {

std::vector<ExtremeCase> sorted_cases() {
  std::vector<ExtremeCase> all;
  const auto take = [&all](std::vector<ExtremeCase> cases) { std::ranges::move(cases, std::back_inserter(all)); };
  take(stiff_cases());
  take(gas_cases());
  take(shape_cases());
  take(scale_cases());
  take(input_cases());
  take(contact_cases());
  take(meeting_cases());
  take(endurance_cases());
  std::ranges::sort(all, {}, &ExtremeCase::number);
  return all;
}

}  // namespace

const std::vector<ExtremeCase>& extreme_cases() {
  static const std::vector<ExtremeCase> all = sorted_cases();
  return all;
}

std::string scene_path(const std::string& file) {
  return std::string(PNEUMA_EXTREME_SCENES "/").append(file);
}

}  // namespace pneuma::extremes
