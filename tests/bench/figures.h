// The figures that the benchmarks are held to: each is a counter of one benchmark, printed beside its target at the end
// of a run.
#pragma once

#include <string>

namespace pneuma::bench {

enum class Bound { at_least, at_most };

struct Figure {
  std::string benchmark;  // full name, as Google Benchmark prints it
  std::string counter;
  Bound bound = Bound::at_least;
  double target = 0.0;
  std::string meaning;
};

/// Lists a figure; returns true, so that it can stand beside a BENCHMARK registration.
bool expect(Figure figure);

}  // namespace pneuma::bench
