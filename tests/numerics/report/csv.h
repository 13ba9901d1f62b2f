// A CSV file with a header line; numbers as shortest decimals that read back to the same value.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <variant>
#include <vector>

namespace pneuma::report {

class Csv {
 public:
  using Cell = std::variant<std::string, double>;

  /// Throws std::runtime_error naming the file where it cannot be written.
  Csv(const std::filesystem::path& path, const std::vector<std::string>& columns);
  /// One cell a column.
  void row(const std::vector<Cell>& cells);

 private:
  std::filesystem::path path_;
  std::ofstream file_;
  std::size_t columns_;
};

}  // namespace pneuma::report
