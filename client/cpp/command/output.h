// Standard output of the `pneuma` command: lines, and tables for people.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"

namespace pneuma::client {

/// Lines to standard output, each of them passed on at once.
class Output {
 public:
  /// Once a write has failed, every line gives that error.
  base::Status line(std::string_view text);
  /// The reader went away (`pneuma watch W | head`): a reason to end, not a failure.
  [[nodiscard]] bool is_closed() const { return closed_; }

 private:
  base::Status failure_;
  bool closed_ = false;
};

/// Columns as wide as their widest cell: text to the left, numbers to the right.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  /// As many cells as the header has.
  void add(std::vector<std::string> row);
  [[nodiscard]] base::Status print(Output& output) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// Short, for people: six significant digits.
[[nodiscard]] std::string number_text(double value);

}  // namespace pneuma::client
