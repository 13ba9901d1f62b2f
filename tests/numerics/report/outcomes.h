// What the report's rows come to, and what of it has changed.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace pneuma::report {

/// A row whose outcome does not depend on the machine: a test fails when it changes. No times in it.
struct Outcome {
  std::string row;      // "stability IMPLICIT_EULER k=1e6 dt=1/60"
  std::string outcome;  // "holds", "fails", "stable", "order 2"
};

/// Row, tab, outcome, a line each.
[[nodiscard]] std::string text_of(const std::vector<Outcome>& outcomes);

/// What the rows of `expected`, as text_of has them, say otherwise, and what they do not know, a line each.
[[nodiscard]] std::vector<std::string> changes(std::istream& expected, const std::vector<Outcome>& outcomes);

}  // namespace pneuma::report
