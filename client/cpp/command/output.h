// Standard output of the `pneuma` command: lines, and tables for people.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "command/terminal.h"

namespace pneuma::client {

enum class LineEnds {
  escaped,  // one line, whatever is in it
  kept,     // and tabs. Only of a text in which the strings of others are escaped already
};

/// Fit for a terminal, whoever it comes from: what does not show (base/hidden_text.h) is written as JSON would, \u001b.
/// JSON means the same then.
[[nodiscard]] std::string shown(std::string_view text, LineEnds ends = LineEnds::escaped);

/// Lines to standard output, each of them passed on at once.
class Output {
 public:
  /// Writes it as shown() has it. Once a write has failed, every line gives that error.
  base::Status line(std::string_view text, LineEnds ends = LineEnds::escaped);
  /// The same of a text with colours and moves of the cursor, in which all that others wrote went through shown().
  base::Status drawn(std::string_view text);
  /// The reader went away (`pneuma watch W | head`): a reason to end, not a failure.
  [[nodiscard]] bool is_closed() const { return closed_; }

 private:
  base::Status failure_;
  bool closed_ = false;
};

/// Columns as wide as their widest cell: text to the left, numbers to the right. Where the terminal takes colour, the
/// header is bold and rows have their style.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  /// As many cells as the header has.
  void add(std::vector<std::string> row, Style style = Style::plain);
  /// Cut to `columns_max`; 0: as long as they are.
  [[nodiscard]] std::vector<std::string> lines(bool with_colour, std::size_t columns_max = 0) const;
  [[nodiscard]] base::Status print(Output& output) const;

 private:
  std::vector<std::vector<std::string>> rows_;
  std::vector<Style> styles_{Style::bold};  // of each row
};

/// Short, for people: six significant digits.
[[nodiscard]] std::string number_text(double value);

}  // namespace pneuma::client
