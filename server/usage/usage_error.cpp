#include "base/nearest_word.h"
#include "usage/table.h"
#include "usage/usage.h"

namespace pneuma::usage {

namespace {

std::string unknown_word(const std::string& kind, const std::string& word, const std::vector<std::string>& known,
                         const std::string& command) {
  const std::string meant = base::did_you_mean(word, known);
  return "no " + kind + " " + word + (meant.empty() ? "; " + command + " --help lists them" : meant);
}

}  // namespace

std::string usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> unknown = app.remaining(true);
  if (unknown.empty()) return error.what();
  const auto code = static_cast<CLI::ExitCodes>(error.get_exit_code());
  // A flag that is missing may be there, misspelt.
  const bool is_misspelt = code == CLI::ExitCodes::RequiredError && unknown.front().starts_with('-');
  if (code != CLI::ExitCodes::ExtrasError && !is_misspelt) return error.what();
  // Down to the subcommand that was named last; the flags of all on the way may stand behind it.
  std::vector<std::string> flags;
  std::string command = app.get_name();
  const CLI::App* last = &app;
  for (;;) {
    for (const CLI::Option* flag : flags_of(*last)) flags.push_back(long_name(*flag));
    const auto chosen = last->get_subcommands();
    if (chosen.empty()) break;
    last = chosen.front();
    command += " " + last->get_name();
  }
  const std::string& word = unknown.front();
  if (word.starts_with('-')) return unknown_word("flag", word, flags, command);
  std::vector<std::string> names;
  for (const CLI::App* one : subcommands_of(*last)) names.push_back(one->get_name());
  return names.empty() ? error.what() : unknown_word("command", word, names, command);
}

}  // namespace pneuma::usage
