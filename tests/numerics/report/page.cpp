#include "numerics/report/page.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace pneuma::report {
namespace {

bool is_number(const std::string& cell) {
  return cell.find_first_of("0123456789") != std::string::npos &&
         cell.find_first_not_of("0123456789.,e+-x% \u00b1") == std::string::npos;
}

}  // namespace

std::string number(double value, int digits) {
  if (!std::isfinite(value)) return "failed";
  constexpr double plain_max = 1e6;
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  const double rounded = std::strtod(text.data(), nullptr);
  return std::abs(rounded) >= std::pow(10.0, digits) && std::abs(rounded) < plain_max ? fixed(rounded, 0) : text.data();
}

std::string fixed(double value, int decimals) {
  if (!std::isfinite(value)) return "failed";
  std::array<char, 340> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

std::string percent(double ratio, int digits) {
  return std::isfinite(ratio) ? number(100.0 * ratio, digits) + " %" : number(ratio);
}

void Page::block(std::string_view text) {
  if (!markdown_.empty()) markdown_ += '\n';
  markdown_.append(text) += '\n';
  in_list_ = false;
}

void Page::heading(std::string_view title) {
  block(std::string("## ").append(title));
}

void Page::subheading(std::string_view title) {
  block(std::string("### ").append(title));
}

void Page::paragraph(std::string_view text) {
  block(text);
}

void Page::bullet(std::string_view text) {
  if (!in_list_) markdown_ += '\n';
  markdown_.append("- ").append(text) += '\n';
  in_list_ = true;
}

void Page::table(const std::vector<std::string>& columns, const std::vector<std::vector<std::string>>& rows) {
  std::string text = "|";
  for (const std::string& column : columns) text.append(" ").append(column).append(" |");
  text += "\n|";
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const bool numbers = std::ranges::all_of(rows, [&](const auto& row) { return is_number(row[i]); });
    text += numbers && !rows.empty() ? " ---: |" : " --- |";
  }
  for (const std::vector<std::string>& row : rows) {
    assert(row.size() == columns.size());
    text += "\n|";
    for (const std::string& cell : row) text.append(" ").append(cell).append(" |");
  }
  block(text);
}

void Page::image(std::string_view path, std::string_view caption) {
  block(std::string("![").append(caption).append("](").append(path).append(")"));
  paragraph(std::string("*").append(caption).append("*"));
}

}  // namespace pneuma::report
