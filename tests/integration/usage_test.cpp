// Shows that each program's manual page and completion hold every flag and subcommand that its --help lists, and that
// bash completes by them.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>

#include <sys/stat.h>

#include "served.h"
#include "support/temporary_folder.h"

namespace pneuma::integration {
namespace {

using support::run_program;

const std::vector<std::string> programs{"pneuma", "pneuma-server", "pneuma-sim"};

std::string folder_of_programs() {
  const std::string path = support::program_path("pneuma");
  return path.substr(0, path.rfind('/'));
}

std::string printed(const std::string& program, const std::vector<std::string>& arguments) {
  const auto finished = run_program(program, arguments);
  EXPECT_EQ(finished.exit_status, 0) << program << ": " << finished.error_output;
  return finished.output;
}

std::vector<std::string> found(const std::string& text, const std::string& pattern) {
  const std::regex wanted(pattern, std::regex::multiline);
  std::vector<std::string> all;
  for (std::sregex_iterator at(text.begin(), text.end(), wanted), end; at != end; ++at) all.push_back((*at)[1]);
  return all;
}

bool holds_word(const std::string& text, const std::string& word) {
  return std::regex_search(text, std::regex("(^|[^a-z-])" + word + "($|[^a-z-])", std::regex::multiline));
}

TEST(Usage, WhatHelpListsIsInTheManualPageAndInEachCompletion) {
  for (const std::string& program : programs) {
    std::string manual = printed(program, {"--manual"});
    std::erase(manual, '\\');  // before dashes
    const std::string bash = printed(program, {"--completion", "bash"});
    const std::string zsh = printed(program, {"--completion", "zsh"});
    const std::string fish = printed(program, {"--completion", "fish"});
    const std::string help = printed(program, {"--help"});
    auto commands = found(help.substr(std::min(help.find("Subcommands:"), help.size())), "^  ([a-z]+) ");
    commands.emplace_back();  // the program itself
    EXPECT_EQ(commands.size() > 1, program != "pneuma-sim");
    for (const std::string& command : commands) {
      SCOPED_TRACE(program + " " + command);
      const auto flags =
          found(command.empty() ? help : printed(program, {command, "--help"}), "^  (?:-h,)?--([a-z0-9-]+)");
      EXPECT_FALSE(flags.empty());
      for (const std::string& flag : flags) {
        EXPECT_TRUE(manual.find("fB--" + flag + "fR") != std::string::npos) << flag;
        EXPECT_TRUE(holds_word(bash, "--" + flag)) << flag;
        EXPECT_TRUE(zsh.find("*--" + flag + "[") != std::string::npos) << flag;
        EXPECT_TRUE(holds_word(fish, "-l " + flag)) << flag;
      }
      if (command.empty()) continue;
      EXPECT_NE(manual.find("\n.SS " + command + "\n"), std::string::npos);
      EXPECT_TRUE(holds_word(bash, command) && holds_word(zsh, command) && holds_word(fish, "-fa " + command));
    }
  }
}

TEST(Usage, EachProgramSaysWhatAWrongWordMayHaveMeant) {
  const auto told = [](const std::string& program, const std::vector<std::string>& arguments) {
    const auto finished = run_program(program, arguments);
    EXPECT_EQ(finished.exit_status, 2);
    return finished.error_output;
  };
  EXPECT_EQ(told("pneuma-server", {"--lsten", "x"}), "pneuma-server: no flag --lsten; did you mean --listen?\n");
  EXPECT_EQ(told("pneuma-server", {"tokne"}), "pneuma-server: no command tokne; did you mean token?\n");
  EXPECT_EQ(told("pneuma-server", {"token", "list", "--tokesn", "x"}),
            "pneuma-server: no flag --tokesn; did you mean --tokens?\n");
  EXPECT_EQ(told("pneuma-sim", {"hand", "--secnods", "1"}), "pneuma-sim: no flag --secnods; did you mean --seconds?\n");
}

class Completion : public Served {
 protected:
  /// What bash offers for the last of the words.
  std::string completed(std::vector<std::string> words, const std::string& programs_in = folder_of_programs()) {
    const std::string script = folder_ / "script";
    std::ofstream(script) << printed(words.front(), {"--completion", "bash"});
    std::vector<std::string> arguments{
        "-c",
        "PATH=$1:$PATH; source \"$2\"; shift 2; COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); \"_${1//-/_}\"; "
        "echo \"${COMPREPLY[*]}\"",
        "bash", programs_in, script};
    arguments.insert(arguments.end(), words.begin(), words.end());
    auto bash = support::Program::start("/bin/bash", arguments);
    EXPECT_TRUE(bash.ok());
    const auto line = bash->next_line(patience);
    EXPECT_TRUE(line.ok()) << line.status().message() << line.status().where();
    return line.ok() ? *line : "";
  }
  support::TemporaryFolder folder_;
};

TEST_F(Completion, BashKnowsCommandsFlagsAndNamedValues) {
  EXPECT_EQ(completed({"pneuma", "wat"}), "watch");
  EXPECT_EQ(completed({"pneuma", "watch", "w", "--max"}), "--max-error");
  EXPECT_EQ(completed({"pneuma", "watch", "w", "--js"}), "--json") << "a flag of the program itself";
  EXPECT_EQ(completed({"pneuma", "export", "f", "--format", ""}), "obj gltf pc2 usda");
  EXPECT_EQ(completed({"pneuma-server", "token", "n"}), "new");
  EXPECT_EQ(completed({"pneuma-sim", "--substep"}), "--substeps");
}

TEST_F(Completion, BashAsksTheServerForTheNamesOfItsWorlds) {
  start({"--scene", "five-balls", "--scene", "hand"});
  ::setenv("PNEUMA_SERVER", server_->tcp_address().c_str(), 1);
  EXPECT_EQ(completed({"pneuma", "stats", "fi"}), "five-balls");
  EXPECT_EQ(completed({"pneuma", "stats", ""}), "five-balls hand");
  EXPECT_EQ(completed({"pneuma", "--server", "elsewhere", "stats", ""}), "") << "they may be another server's";
  ::unsetenv("PNEUMA_SERVER");
}

// Bash carries out what stands in $() in words that it completes by.
TEST_F(Completion, AServersNamesAreNoCommands) {
  const std::string made = folder_ / "made";
  const std::string program = folder_ / "pneuma";
  std::ofstream(program) << "#!/bin/sh\nprintf 'world tick\\n$(touch " << made << ") 1\\ngood 2\\n`touch " << made
                         << "` 3\\n'\n";
  ASSERT_EQ(::chmod(program.c_str(), 0700), 0);
  EXPECT_EQ(completed({"pneuma", "stats", ""}, folder_.path()), "good");
  EXPECT_FALSE(std::filesystem::exists(made));
}

}  // namespace
}  // namespace pneuma::integration
