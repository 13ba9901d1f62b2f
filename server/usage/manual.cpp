#include <algorithm>
#include <cstdio>
#include <map>

#include "base/version.h"
#include "usage/table.h"
#include "usage/usage.h"

namespace pneuma::usage {

namespace {

/// Text as troff takes it: a dash of a flag is a dash, and no line begins a request.
std::string roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
  }
  return out.starts_with('.') || out.starts_with('\'') ? "\\&" + out : out;
}

std::string capitals(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

std::string flags_text(const CLI::App& command) {
  std::string text;
  for (const CLI::Option* flag : flags_of(command)) {
    text += ".TP\n\\fB" + roff(long_name(*flag)) + "\\fR";
    const auto choices = choices_of(*flag);
    std::string values;
    for (const std::string& choice : choices) values += (values.empty() ? "" : "|") + choice;
    if (takes_value(*flag)) text += " \\fI" + roff(choices.empty() ? value_name(*flag) : values) + "\\fR";
    text += "\n" + roff(flag->get_description());
    if (!flag->get_default_str().empty()) text += ". Default: " + roff(flag->get_default_str());
    text += "\n";
  }
  return text;
}

std::string arguments_text(const CLI::App& command) {
  std::string text;
  for (const CLI::Option* argument : arguments_of(command)) {
    const std::string name = capitals(argument->get_name());
    text += argument->get_required() ? " \\fI" + name + "\\fR" : " [\\fI" + name + "\\fR]";
  }
  return text;
}

void write_commands(const CLI::App& app, const std::string& before, std::string& page) {
  for (const CLI::App* command : subcommands_of(app)) {
    const std::string name = before + command->get_name();
    page += ".SS " + roff(name) + "\n.B " + roff(name) + "\n[\\fIOPTION\\fR...]" + arguments_text(*command) + "\n.PP\n";
    page += roff(command->get_description()) + ".\n";
    for (const CLI::Option* argument : arguments_of(*command)) {
      if (argument->get_description().empty()) continue;
      page += ".TP\n\\fI" + capitals(argument->get_name()) + "\\fR\n" + roff(argument->get_description()) + "\n";
    }
    page += flags_text(*command);
    write_commands(*command, name + " ", page);
  }
}

void add_print(CLI::App& app, const std::string& flag, const std::string& what, std::string (*make)(const CLI::App&)) {
  app.add_flag_callback(
         flag,
         [&app, make] {
           std::fputs(make(app).c_str(), stdout);
           throw CLI::Success();
         },
         what)
      ->group("Documents");
}

}  // namespace

std::string manual_page(const CLI::App& app) {
  const std::string& name = app.get_name();
  std::string page = ".TH " + capitals(roff(name)) + " 1 \"\" \"Pneuma " + std::string(base::version) + "\"\n";
  std::string description = app.get_description();
  while (description.ends_with('.')) description.pop_back();
  page += ".SH NAME\n" + roff(name) + " \\- " + roff(description) + "\n";
  const auto commands = subcommands_of(app);
  page += ".SH SYNOPSIS\n.B " + roff(name) + "\n[\\fIOPTION\\fR...]" + arguments_text(app) +
          (commands.empty() ? "" : " \\fICOMMAND\\fR ...") + "\n";
  page += ".SH OPTIONS\n" + flags_text(app);
  if (!commands.empty()) {
    page += ".SH COMMANDS\n";
    write_commands(app, "", page);
  }
  page += ".SH EXIT STATUS\n0: done. 1: the work failed. 2: bad usage.\n";
  return page;
}

void add_generators(CLI::App& app) {
  static const std::map<std::string, std::string (*)(const CLI::App&)> makers{
      {"bash", bash_completion}, {"fish", fish_completion}, {"zsh", zsh_completion}};
  app.add_option_function<std::string>(
         "--completion",
         [&app](const std::string& shell) {
           std::fputs(makers.at(shell)(app).c_str(), stdout);
           throw CLI::Success();
         },
         "Print completion for this shell, and end")
      ->check(CLI::IsMember({"bash", "fish", "zsh"}))
      ->group("Documents");
  add_print(app, "--manual", "Print the manual page, for man -l, and end", manual_page);
}

}  // namespace pneuma::usage
