#include "support/golden.h"

#include <fstream>
#include <sstream>

namespace pneuma::support {

std::string golden_path(const std::string& name) {
  return std::string(PNEUMA_GOLDEN_DIR) + "/" + name;
}

std::vector<GoldenRecord> read_golden(const std::string& name) {
  std::ifstream in(golden_path(name));
  std::vector<GoldenRecord> records;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with('#')) continue;
    if (line.empty()) {
      inside = false;
      continue;
    }
    if (!inside) records.emplace_back();
    inside = true;
    const std::size_t space = line.find(' ');
    records.back().emplace_back(line.substr(0, space), space == std::string::npos ? "" : line.substr(space + 1));
  }
  return records;
}

std::vector<std::string> values_of(const GoldenRecord& record, const std::string& key) {
  std::vector<std::string> values;
  for (const auto& [name, value] : record) {
    if (name == key) values.push_back(value);
  }
  return values;
}

std::vector<std::int64_t> parse_integers(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::int64_t> integers;
  for (std::int64_t value = 0; in >> value;) integers.push_back(value);
  return integers;
}

std::string parse_hex(const std::string& text) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
    bytes.push_back(static_cast<char>(std::stoi(text.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

}  // namespace pneuma::support
