// A Markdown page under construction.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace pneuma::report {

/// A number to so many significant digits: "0.00123", "1.2e-09", "45300", a power of ten from 10^6 up; "failed" of what
/// is not finite.
[[nodiscard]] std::string number(double value, int digits = 3);
/// A number to so many decimals: "2.00".
[[nodiscard]] std::string fixed(double value, int decimals);
/// "0.5 %", of a ratio.
[[nodiscard]] std::string percent(double ratio, int digits = 2);

class Page {
 public:
  void heading(std::string_view title);     // ##
  void subheading(std::string_view title);  // ###
  void paragraph(std::string_view text);    // Markdown
  void bullet(std::string_view text);
  /// One cell a column; a column whose cells are all numbers is set flush right.
  void table(const std::vector<std::string>& columns, const std::vector<std::vector<std::string>>& rows);
  void image(std::string_view path, std::string_view caption);

  [[nodiscard]] const std::string& markdown() const { return markdown_; }

 private:
  void block(std::string_view text);
  std::string markdown_;
  bool in_list_ = false;
};

}  // namespace pneuma::report
