#include "numerics/extremes/extreme_case.h"

namespace pneuma::extremes {

const std::vector<ExtremeCase>& extreme_cases() {
  static const std::vector<ExtremeCase> all;
  return all;
}

std::string scene_path(const std::string& file) {
  return std::string(PNEUMA_EXTREME_SCENES "/").append(file);
}

}  // namespace pneuma::extremes
