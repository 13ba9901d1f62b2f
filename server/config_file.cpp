#include "config_file.h"

#include <iterator>
#include <sstream>
#include <string>
#include <string_view>

namespace pneuma {
namespace {

constexpr std::string_view blanks = " \t\r";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

/// A quote opens where a value begins: after `=`, `[` or a comma, or at the line's front in a list that goes on.
bool leaves_quote_open(std::string_view line) {
  char quote = 0;
  char before = ',';
  for (const char c : line) {
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '#') {
      break;
    } else if ((c == '"' || c == '\'') && (before == '=' || before == '[' || before == ',')) {
      quote = c;
    }
    if (blanks.find(c) == std::string_view::npos) before = c;
  }
  return quote != 0;
}

}  // namespace

// Line by line, as CLI11 takes them: a list may go on over several.
void ConfigFile::check(const std::string& text) const {
  std::istringstream lines(text);
  std::string line;
  bool in_list = false;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto refuse = [number](const std::string& what) {
      throw CLI::ConfigError("line " + std::to_string(number) + ": " + what);
    };
    std::string_view rest = trimmed(line);
    if (rest.empty() || rest.front() == '#' || rest.front() == ';') continue;
    if (leaves_quote_open(rest)) refuse("a quote is not closed");
    rest = trimmed(rest.substr(0, rest.find('#')));
    if (!in_list) {
      if (rest.front() == '[') refuse("there are no sections here");
      const std::size_t equals = rest.find('=');
      const std::string key(trimmed(rest.substr(0, equals)));
      if (app_.get_option_no_throw("--" + key) == nullptr) {
        refuse("no flag is named " + key + "; pneuma-server --help lists them");
      }
      if (equals == std::string_view::npos) continue;
      in_list = trimmed(rest.substr(equals + 1)).starts_with('[');
    }
    if (in_list) in_list = !rest.ends_with(']');
  }
}

std::vector<CLI::ConfigItem> ConfigFile::from_config(std::istream& input) const {
  const std::string text(std::istreambuf_iterator<char>(input), {});
  check(text);
  std::istringstream again(text);
  return CLI::ConfigTOML::from_config(again);
}

}  // namespace pneuma
