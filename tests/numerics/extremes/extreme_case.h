// The extreme cases that a solver of soft bodies must meet: each a scene file of tests/numerics/scenes, what must hold,
// and what came of it. The tests run them, and the report has a row of each.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace pneuma::extremes {

struct Result {
  bool holds = false;
  std::string figure;  // what was found, beside the criterion: "radius 0.3 % off"; the same on any machine
};

struct ExtremeCase {
  int number = 0;
  std::string name;       // "stiffness times a million"
  std::string scene;      // file in tests/numerics/scenes
  std::string criterion;  // "radius within 2 %"
  bool holds = true;      // what is expected today: a row that does not hold yet stands in the page as failing
  bool alone = false;     // it measures the whole process: no other case may run meanwhile
  /// `quick`: in a few seconds, for the tests; else as long as the case asks for.
  std::function<Result(bool quick)> run;
  /// What Bullet does with the same scene; null where it cannot run it.
  std::function<std::string()> bullet;
};

/// In the order of their numbers.
[[nodiscard]] const std::vector<ExtremeCase>& extreme_cases();

/// The path of a file in tests/numerics/scenes.
[[nodiscard]] std::string scene_path(const std::string& file);

}  // namespace pneuma::extremes
