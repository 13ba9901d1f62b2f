// `pneuma top`: the worlds and what they take, drawn over once a second on a terminal.
#include <algorithm>
#include <chrono>

#include <unistd.h>

#include "command/commands.h"
#include "command/interrupt.h"
#include "command/json.h"
#include "command/terminal.h"

namespace pneuma::client {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds redraw_interval{1};
// Each is a request a redraw; a server takes 60 a second by default.
constexpr std::size_t worlds_shown_max = 50;
// More than a whole tick late at the usual rate of 60 Hz.
constexpr double late_ms = 16.7;

std::uint64_t bytes_held(const v1::Stats& stats) {
  std::uint64_t bytes = 0;
  for (const auto& stage : stats.stages()) bytes += stage.bytes();
  return bytes;
}

/// "-" for each figure of a world that has none yet, or was destroyed meanwhile.
std::vector<std::string> row_of(const v1::WorldList::World& world, const base::Result<v1::Stats>& stats) {
  std::vector<std::string> row{world.name(), world_state(world), std::to_string(world.tick())};
  if (!stats.ok()) {
    row.insert(row.end(), {"-", "-", "-", "-", std::to_string(world.subscribers()), "-", "-"});
    return row;
  }
  row.insert(row.end(), {number_text(stats->step_time_ms()), number_text(stats->step_time_max_ms()),
                         number_text(stats->due_error_ms_p99()), number_text(stats->time_ratio()),
                         std::to_string(stats->subscribers()), number_text(stats->frame_bytes_s()),
                         std::to_string(bytes_held(*stats))});
  return row;
}

JsonObject json_of(const v1::WorldList::World& world, const v1::Stats& stats) {
  JsonObject object;
  object.add("world", world.name())
      .add("state", world_state(world))
      .add("tick", world.tick())
      .add("step_ms", stats.step_time_ms())
      .add("step_ms_max", stats.step_time_max_ms())
      .add("late_ms_p99", stats.due_error_ms_p99())
      .add("time_ratio", stats.time_ratio())
      .add("clients", std::uint64_t{stats.subscribers()})
      .add("frame_bytes_s", stats.frame_bytes_s())
      .add("memory_bytes", bytes_held(stats));
  return object;
}

Style style_of(const v1::WorldList::World& world, const base::Result<v1::Stats>& stats) {
  if (world_style(world) != Style::plain) return world_style(world);
  return stats.ok() && stats->due_error_ms_p99() > late_ms ? Style::yellow : Style::plain;
}

/// The table's lines, cut to the terminal.
base::Result<std::vector<std::string>> draw(Session& session, std::size_t worlds_max, std::set<std::string>& silent) {
  const base::Status unknown(base::StatusCode::unavailable, "not asked");
  const auto list = session.client.list_worlds();
  if (!list.ok()) return list.status();
  Table table({"world", "state", "tick", "step_ms", "step_ms_max", "late_ms_p99", "time_ratio", "clients",
               "frame_bytes_s", "memory_bytes"});
  const auto count = std::min(static_cast<std::size_t>(list->worlds_size()), worlds_max);
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& world = list->worlds(static_cast<int>(i));
    // Of a world that is being restored, was destroyed, or takes long for a tick, no figures; that one is asked once.
    const bool is_asked = !world.restoring() && !world.damaged() && !silent.contains(world.name());
    const auto stats = is_asked ? session.client.stats(world.name()) : base::Result<v1::Stats>(unknown);
    if (is_asked && stats.status().code() == base::StatusCode::unavailable) silent.insert(world.name());
    if (!session.json) table.add(row_of(world, stats), style_of(world, stats));
    if (session.json && stats.ok()) lines.push_back(json_of(world, *stats).text());
  }
  if (session.json) return lines;
  const bool to_terminal = ::isatty(STDOUT_FILENO) != 0;
  lines = table.lines(takes_colour(STDOUT_FILENO), to_terminal ? terminal_size(STDOUT_FILENO).columns : 0);
  const auto left_out = static_cast<std::size_t>(list->worlds_size()) - count;
  if (left_out > 0) lines.push_back("and " + std::to_string(left_out) + " more");
  return lines;
}

}  // namespace

base::Status top(Session& session, bool once) {
  catch_interrupts();
  const bool is_live = !once && !session.json && ::isatty(STDOUT_FILENO) != 0;
  std::string over;  // what was drawn before
  std::set<std::string> silent;
  for (;;) {
    // Room for the header, for how many more there are, and for the line that the cursor is on.
    const std::size_t rows = terminal_size(STDOUT_FILENO).rows;
    const std::size_t room = is_live ? std::max<std::size_t>(rows, 4) - 3 : worlds_shown_max;
    const auto lines = draw(session, std::min(room, worlds_shown_max), silent);
    if (!lines.ok()) return lines.status();
    std::string text = over;
    for (const std::string& line : *lines) text += (&line == &lines->front() ? "" : "\n") + line;
    if (!lines->empty()) {
      if (base::Status written = session.output.drawn(text); !written.ok()) return written;
    }
    if (!is_live) return {};
    over = "\033[" + std::to_string(lines->size()) + "A\r\033[J";
    const auto due = Clock::now() + redraw_interval;
    for (auto now = Clock::now(); now < due; now = Clock::now()) {
      if (interrupted()) return {};
      if (const auto update = session.client.next_update(interrupt_patience); !update.ok()) return update.status();
    }
  }
}

}  // namespace pneuma::client
