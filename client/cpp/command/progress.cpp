#include "command/progress.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include <unistd.h>

#include "command/terminal.h"

namespace pneuma::client {

namespace {

// Ten times a second looks smooth; a log wants no more than it takes to see that work goes on.
constexpr std::chrono::milliseconds bar_interval{100};
constexpr std::chrono::seconds line_interval{5};

constexpr std::size_t bar_cells = 30;

std::chrono::steady_clock::duration interval(Progress::Form form) {
  if (form == Progress::Form::bar) return bar_interval;
  return line_interval;
}

}  // namespace

std::string bar_text(std::optional<double> fraction, const std::string& text, std::size_t columns) {
  std::string line;
  if (fraction) {
    const double done = std::clamp(*fraction, 0.0, 1.0);
    const auto cells = static_cast<std::size_t>(done * bar_cells);
    std::string bar(cells, '=');
    if (cells < bar_cells) bar += '>';
    bar.resize(bar_cells, ' ');
    std::array<char, 16> percent{};
    std::snprintf(percent.data(), percent.size(), "] %3.0f %%  ", std::floor(100.0 * done));
    line = "[" + bar + percent.data();
  }
  line += text;
  // A terminal that is full to its last column may go to the next line by itself.
  if (line.size() >= columns) line.resize(columns > 0 ? columns - 1 : 0);
  return line;
}

Progress::Progress(Output& output, Form form, TimePoint now)
    : output_(output), form_(form), next_(now + interval(form)) {}

Progress::Form Progress::form_for(bool json) {
  if (json) return Form::json;
  return ::isatty(STDERR_FILENO) != 0 ? Form::bar : Form::lines;
}

base::Status Progress::show(TimePoint now, const State& state) {
  next_ = now + interval(form_);
  switch (form_) {
    case Form::json:
      return output_.line(state.json.text());
    case Form::lines:
      std::fprintf(stderr, "%s\n", bar_text({}, state.text, std::string::npos).c_str());
      return {};
    case Form::bar:
      std::fprintf(stderr, "\r\033[K%s",
                   bar_text(state.fraction, state.text, terminal_size(STDERR_FILENO).columns).c_str());
      drawn_ = true;
      return {};
  }
  return {};
}

void Progress::clear() {
  if (drawn_) std::fputs("\r\033[K", stderr);
  drawn_ = false;
}

}  // namespace pneuma::client
