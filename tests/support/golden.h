// Reads the text files of tests/golden (its README.md describes them).
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace pneuma::support {

/// The lines of one record, in order: key and value.
using GoldenRecord = std::vector<std::pair<std::string, std::string>>;

/// Where tests/golden/NAME is.
[[nodiscard]] std::string golden_path(const std::string& name);

/// The records of tests/golden/NAME; none where the file is not there.
[[nodiscard]] std::vector<GoldenRecord> read_golden(const std::string& name);

/// The values of all lines with this key.
[[nodiscard]] std::vector<std::string> values_of(const GoldenRecord& record, const std::string& key);
[[nodiscard]] std::vector<std::int64_t> parse_integers(const std::string& text);
[[nodiscard]] std::string parse_hex(const std::string& text);

}  // namespace pneuma::support
