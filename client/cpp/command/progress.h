// How far long work has come: a bar that is drawn over on a terminal, a line every few seconds elsewhere, an object a
// line for scripts.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

#include "base/status.h"
#include "command/json.h"
#include "command/output.h"

namespace pneuma::client {

/// "[=======>        ]  47 %  text", cut to `columns`; without a fraction the text alone.
[[nodiscard]] std::string bar_text(std::optional<double> fraction, const std::string& text, std::size_t columns);

class Progress {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  enum class Form { bar, lines, json };

  struct State {
    std::optional<double> fraction;  // of the work; none: nobody knows how much there is
    std::string text;
    JsonObject json;
  };

  /// Objects go to `output`; the bar and the lines to standard error, out of the way of what is printed.
  Progress(Output& output, Form form, TimePoint now);
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// A bar where standard error is a terminal.
  [[nodiscard]] static Form form_for(bool json);

  /// Time to show how it stands.
  [[nodiscard]] bool due(TimePoint now) const { return now >= next_; }
  [[nodiscard]] base::Status show(TimePoint now, const State& state);
  /// Takes the bar away, before something else is printed.
  void clear();

 private:
  Output& output_;
  Form form_;
  TimePoint next_;
  bool drawn_ = false;
};

}  // namespace pneuma::client
