#include "base/in_file.h"

#include <regex>

namespace pneuma::base {

Status in_file(const Status& status, const std::string& file) {
  static const std::regex position(R"(line (\d+), column (\d+))");
  std::smatch found;
  if (!std::regex_match(status.where(), found, position)) return {status.code(), status.message(), file};
  return {status.code(), status.what(), file + ":" + found[1].str() + ":" + found[2].str()};
}

}  // namespace pneuma::base
