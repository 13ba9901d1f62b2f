// `pneuma open`: the server's page in the browser.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <string>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/page_link.h"
#include "command/commands.h"
#include "command/json.h"
#include "command/telling.h"

extern "C" {
#include <sys/pidfd.h>  // glibc 2.36 declares its functions without language linkage
}

namespace pneuma::client {

namespace {

// A browser that has not failed by then is shown.
constexpr std::chrono::milliseconds start_patience{3'000};

/// By the command in BROWSER, or xdg-open. False where it cannot be started or fails at once.
bool show_in_browser(std::string link) {
  const char* chosen = std::getenv("BROWSER");
  const bool is_chosen = chosen != nullptr && *chosen != '\0';
  // As is the custom, BROWSER is a list of commands with : between them, each with %s for the link or the link behind
  // it. The shell takes a command's words apart; the link is never part of a script.
  std::string script = is_chosen ? R"(IFS=:; set -f; for command in $BROWSER; do
      IFS=' '; set -- "$1"; found=
      for word in $command; do
        if [ "$word" = %s ]; then set -- "$@" "$1"; found=yes; else set -- "$@" "$word"; fi
      done
      link=$1; shift; [ $found ] || set -- "$@" "$link"
      if command -v "$1" >/dev/null; then exec "$@"; fi
      set -- "$link"
    done; exit 127)"
                                 : R"(exec xdg-open "$1")";
  std::string shell = "sh";
  std::string take_script = "-c";
  std::array<char*, 6> arguments{shell.data(), take_script.data(), script.data(), shell.data(), link.data(), nullptr};
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = -1;
  const int failed = ::posix_spawn(&child, "/bin/sh", &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (failed != 0) return false;
  const int ended = ::pidfd_open(child, 0);
  pollfd entry{.fd = ended, .events = POLLIN, .revents = 0};
  const bool has_ended = ended >= 0 && ::poll(&entry, 1, static_cast<int>(start_patience.count())) > 0;
  if (ended >= 0) ::close(ended);
  if (!has_ended) return true;
  int status = 0;
  return ::waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

base::Status open_page(Session& session, const OpenArguments& arguments) {
  if (!arguments.world.empty()) {
    const auto list = session.client.list_worlds();
    if (!list.ok()) return list.status();
    std::vector<std::string> names;
    for (const auto& world : list->worlds()) names.push_back(world.name());
    if (std::ranges::find(names, arguments.world) == names.end()) {
      const base::Status unknown = base::not_found("no world " + arguments.world);
      return session.json ? unknown : with_suggestion(unknown, arguments.world, names);
    }
  }
  auto address = arguments.http.empty() ? base::http_beside(session.server) : base::Result<std::string>(arguments.http);
  if (!address.ok()) return address.status();
  std::string link = base::page_link(*address, session.tls);
  if (!arguments.world.empty()) link += "/#world=" + arguments.world;
  const bool shown = show_in_browser(link);
  if (session.json) return session.output.line(JsonObject().add("url", link).add("opened", shown).text());
  if (!shown) note(session, "no browser could be started; open this address in one");
  return session.output.line(link);
}

}  // namespace pneuma::client
