// `pneuma play`: serves a recording until the user interrupts.
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <ctime>

#include "base/page_link.h"
#include "command/commands.h"
#include "command/json.h"
#include "command/progress.h"
#include "replay/player.h"

namespace pneuma::client {

namespace {

Progress::State state_of(const replay::Player& player, double duration_s) {
  const replay::Player::Position position = player.position();
  Progress::State state;
  if (duration_s > 0.0) state.fraction = position.at_s / duration_s;
  std::array<char, 128> text{};
  std::snprintf(text.data(), text.size(), "%.1f of %.1f s%s, tick %llu, %u subscribers", position.at_s, duration_s,
                position.world.paused() ? ", paused" : "", static_cast<unsigned long long>(position.world.tick()),
                position.world.subscribers());
  state.text = text.data();
  state.json.add("type", "progress")
      .add("at_s", position.at_s)
      .add("duration_s", duration_s)
      .add("tick", position.world.tick())
      .add("paused", position.world.paused())
      .add("subscribers", std::uint64_t{position.world.subscribers()});
  return state;
}

}  // namespace

base::Status play(FileSession& session, const PlayArguments& arguments) {
  // Blocked before any thread starts, so that only sigtimedwait sees them.
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGTERM);
  sigaddset(&ending, SIGINT);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);

  auto playback = Playback::open(arguments.file);
  if (!playback.ok()) return playback.status();
  tell_damage(*playback);
  const double duration_s = playback->index().duration_s();
  if (arguments.options.play.start_s > duration_s) {
    return base::invalid("the recording ends at " + number_text(duration_s) + " s", "--at");
  }
  replay::PlayerOptions options = arguments.options;
  options.token = session.token;
  options.http = arguments.http;
  if (arguments.http.empty()) {
    auto beside = base::http_beside(options.listen);
    if (!beside.ok()) return beside.status();
    options.http = std::move(*beside);
  }
  replay::Player player(std::move(*playback), options);
  if (base::Status started = player.start(); !started.ok()) return started;
  const std::string tcp = player.tcp_address();
  const std::string http = player.http_address();
  const bool has_page = !options.web_dir.empty() && options.web_dir != "off";
  const std::string link = has_page ? base::page_link(http, false) : "";
  JsonObject ready;
  ready.add("type", "ready").add("tcp", tcp).add("http", http);
  if (!link.empty()) ready.add("page", link);
  base::Status status = session.output.line(session.json ? ready.text() : base::ready_line(tcp, http, link));

  Progress progress(session.output, Progress::form_for(session.json), std::chrono::steady_clock::now());
  constexpr timespec tenth{0, 100'000'000};
  while (status.ok() && sigtimedwait(&ending, nullptr, &tenth) < 0) {
    const auto now = std::chrono::steady_clock::now();
    if (progress.due(now)) status = progress.show(now, state_of(player, duration_s));
  }
  progress.clear();
  player.stop();
  return status;
}

}  // namespace pneuma::client
