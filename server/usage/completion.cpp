#include <algorithm>
#include <functional>

#include "usage/table.h"
#include "usage/usage.h"

namespace pneuma::usage {

namespace {

/// A function's name: "_pneuma_server".
std::string identifier(const std::string& text) {
  std::string name = "_" + text;
  std::replace_if(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// Each `mark` in the text gets `escape` before it.
std::string escaped(std::string text, const std::string& marks, const std::string& escape) {
  for (std::size_t at = 0; (at = text.find_first_of(marks, at)) != std::string::npos; at += escape.size() + 1) {
    text.insert(at, escape);
  }
  return text;
}

/// For a string in single quotes of a shell.
std::string in_single_quotes(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

using Path = std::vector<std::string>;  // of subcommands: {"token", "new"}

/// Calls `visit` with the program and every subcommand below it.
void walk(const CLI::App& app, const Path& path, const std::function<void(const CLI::App&, const Path&)>& visit) {
  visit(app, path);
  for (const CLI::App* command : subcommands_of(app)) {
    Path below = path;
    below.push_back(command->get_name());
    walk(*command, below, visit);
  }
}

std::string slashed(const Path& path) {
  std::string text;
  for (const std::string& name : path) text += "/" + name;
  return text;
}

bool takes_world(const CLI::App& command) {
  const auto arguments = arguments_of(command);
  return std::ranges::any_of(arguments, [](const CLI::Option* argument) { return argument->get_name() == "WORLD"; });
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  const std::string& program = app.get_name();
  std::string paths;   // of all subcommands, as alternatives of a case
  std::string values;  // of flags with named choices
  std::string words;   // by path: subcommands, flags
  walk(app, {}, [&](const CLI::App& command, const Path& path) {
    if (!path.empty()) paths += (paths.empty() ? "" : " | ") + slashed(path);
    std::vector<std::string> flags;
    std::vector<std::string> names;
    for (const CLI::Option* flag : flags_of(command)) {
      flags.push_back(long_name(*flag));
      const auto choices = choices_of(*flag);
      if (!choices.empty()) {
        values += "    " + slashed(path) + ":" + long_name(*flag) + ") choices=" + in_single_quotes(joined(choices)) +
                  " ;;\n";
      }
    }
    // Flags of the program may stand behind its subcommands.
    for (const CLI::Option* flag : flags_of(app)) {
      const bool is_new = std::ranges::find(flags, long_name(*flag)) == flags.end();
      if (!path.empty() && command.get_fallthrough() && is_new) flags.push_back(long_name(*flag));
    }
    for (const CLI::App* below : subcommands_of(command)) names.push_back(below->get_name());
    words += "    '" + slashed(path) + "') flags=" + in_single_quotes(joined(flags)) +
             " names=" + in_single_quotes(joined(names));
    if (takes_world(command)) words += " worlds=yes";
    words += " ;;\n";
  });
  std::string script = "# Completion of " + program + " for bash, made by " + program + " --completion bash.\n";
  script += identifier(program) + "() {\n";
  script += "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} path= i\n";
  script += "  local choices= flags= names= worlds=\n";
  if (!paths.empty()) {
    script += "  for ((i = 1; i < COMP_CWORD; ++i)); do\n    case $path/${COMP_WORDS[i]} in\n      " + paths +
              ") path=$path/${COMP_WORDS[i]} ;;\n    esac\n  done\n";
  }
  if (!values.empty()) script += "  case $path:$before in\n" + values + "  esac\n";
  script += "  case $path in\n" + words + "  esac\n";
  script += "  if [[ -n $choices ]]; then\n    :\n";
  script += "  elif [[ $word == -* ]]; then\n    choices=$flags\n";
  // compgen expands what it is given: of a server's names only those are taken that a good one gives. A server that is
  // named on the line may be another than the one that would be asked here.
  script += "  elif [[ -n $worlds ]]; then\n";
  script += "    [[ \" ${COMP_WORDS[*]}\" == *' --server'* ]] ||\n";
  script +=
      "      choices=$(" + program + " worlds 2>/dev/null | sed -n '1d; s/^\\([A-Za-z0-9._-]\\{1,\\}\\) .*/\\1/p')\n";
  script += "  else\n    choices=$names\n  fi\n";
  script += "  mapfile -t COMPREPLY < <(compgen -W \"$choices\" -- \"$word\")\n}\n";
  return script + "complete -o default -F " + identifier(program) + " " + program + "\n";
}

std::string zsh_completion(const CLI::App& app) {
  const std::string& program = app.get_name();
  std::string functions;
  walk(app, {}, [&](const CLI::App& command, const Path& path) {
    const auto below = subcommands_of(command);
    const std::string name = identifier(program + slashed(path));
    functions += name + "() {\n  _arguments" + (below.empty() ? "" : " -C");
    for (const CLI::Option* flag : flags_of(command)) {
      std::string entry = "*" + long_name(*flag) + "[" + escaped(flag->get_description(), "[]:\\", "\\") + "]";
      const auto choices = choices_of(*flag);
      if (takes_value(*flag)) {
        entry += ":" + value_name(*flag) + ":" + (choices.empty() ? "_files" : "(" + joined(choices) + ")");
      }
      functions += " \\\n    " + in_single_quotes(entry);
    }
    if (below.empty()) {
      functions += " \\\n    '*:argument:_files'\n}\n";
      return;
    }
    std::string names;
    for (const CLI::App* one : below) {
      names += " " + one->get_name() + "\\:" + in_single_quotes(escaped(one->get_description(), ":()\\", "\\"));
    }
    functions += " \\\n    " + in_single_quotes("1:command:((" + names + " ))") + " \\\n    '*::argument:->below'\n";
    functions += "  [[ $state == below ]] || return\n  case $words[1] in\n";
    for (const CLI::App* one : below) {
      functions +=
          "    " + one->get_name() + ") " + identifier(program + slashed(path) + "/" + one->get_name()) + " ;;\n";
    }
    functions += "  esac\n}\n";
  });
  return "#compdef " + program + "\n# Made by " + program + " --completion zsh.\n" + functions + identifier(program) +
         " \"$@\"\n";
}

std::string fish_completion(const CLI::App& app) {
  const std::string& program = app.get_name();
  std::string script = "# Completion of " + program + " for fish, made by " + program + " --completion fish.\n";
  const auto quoted = [](const std::string& text) { return "'" + escaped(text, "'\\", "\\") + "'"; };
  walk(app, {}, [&](const CLI::App& command, const Path& path) {
    std::string condition;
    for (const std::string& name : path) {
      condition += (condition.empty() ? "" : "; and ") + ("__fish_seen_subcommand_from " + name);
    }
    const std::string begin = "complete -c " + program + (condition.empty() ? "" : " -n '" + condition + "'");
    for (const CLI::Option* flag : flags_of(command)) {
      const auto choices = choices_of(*flag);
      script += begin + " -l " + flag->get_lnames().front() + (takes_value(*flag) ? " -r" : "");
      if (!choices.empty()) script += " -fa " + quoted(joined(choices));
      script += " -d " + quoted(flag->get_description()) + "\n";
    }
    const auto below = subcommands_of(command);
    std::vector<std::string> names;
    for (const CLI::App* one : below) names.push_back(one->get_name());
    const std::string none_yet = "not __fish_seen_subcommand_from " + joined(names);
    for (const CLI::App* one : below) {
      script += "complete -c " + program + " -n '" + (condition.empty() ? "" : condition + "; and ") + none_yet +
                "' -fa " + one->get_name() + " -d " + quoted(one->get_description()) + "\n";
    }
  });
  return script;
}

}  // namespace pneuma::usage
