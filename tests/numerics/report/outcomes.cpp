#include "numerics/report/outcomes.h"

#include <istream>
#include <map>

namespace pneuma::report {

std::string text_of(const std::vector<Outcome>& outcomes) {
  std::string text;
  for (const auto& [row, outcome] : outcomes) text.append(row).append("\t").append(outcome).append("\n");
  return text;
}

std::vector<std::string> changes(std::istream& expected, const std::vector<Outcome>& outcomes) {
  std::map<std::string, std::string> left;
  for (const auto& [row, outcome] : outcomes) left[row] = outcome;
  std::vector<std::string> lines;
  for (std::string line; std::getline(expected, line);) {
    const std::size_t tab = line.find('\t');
    const std::string row = line.substr(0, tab);
    const std::string before = tab == std::string::npos ? "" : line.substr(tab + 1);
    const auto now = left.find(row);
    if (now == left.end()) {
      lines.push_back(std::string(row).append(": was ").append(before).append(", is not there"));
      continue;
    }
    if (now->second != before) {
      lines.push_back(std::string(row).append(": was ").append(before).append(", is ").append(now->second));
    }
    left.erase(now);
  }
  for (const auto& [row, outcome] : left) lines.push_back(std::string(row).append(": is new, ").append(outcome));
  return lines;
}

}  // namespace pneuma::report
