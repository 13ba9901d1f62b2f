#include "numerics/report/csv.h"

#include <array>
#include <cassert>
#include <charconv>
#include <stdexcept>

namespace pneuma::report {
namespace {

std::string text_of(const Csv::Cell& cell) {
  if (const auto* text = std::get_if<std::string>(&cell)) {
    if (text->find_first_of(",\"\n") == std::string::npos) return *text;
    std::string quoted = "\"";
    for (const char c : *text) quoted.append(c == '"' ? 2 : 1, c);
    return quoted + '"';
  }
  std::array<char, 32> digits{};
  const std::to_chars_result end = std::to_chars(digits.data(), digits.data() + digits.size(), std::get<double>(cell));
  return {digits.data(), end.ptr};
}

}  // namespace

Csv::Csv(const std::filesystem::path& path, const std::vector<std::string>& columns)
    : path_(path), columns_(columns.size()) {
  std::filesystem::create_directories(path.parent_path());
  file_.open(path);
  row({columns.begin(), columns.end()});
}

void Csv::row(const std::vector<Cell>& cells) {
  assert(cells.size() == columns_);
  for (std::size_t i = 0; i < cells.size(); ++i) file_ << (i == 0 ? "" : ",") << text_of(cells[i]);
  file_ << '\n' << std::flush;
  if (!file_) throw std::runtime_error(path_.string() + ": cannot be written");
}

}  // namespace pneuma::report
