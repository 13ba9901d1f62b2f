// Plots, drawn by gnuplot: SVG for the page, PNG on request. Lines, markers and colours a colour-blind reader can tell
// apart (Okabe and Ito's palette), type large enough for a phone.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace pneuma::report {

struct Axis {
  std::string label;  // with its unit: "CPU time (s)"
  bool log = false;
  std::pair<double, double> range{0.0, 0.0};  // equal: as the points need
};

enum class Mark { line_and_points, points, circles, crosses, line, dashed };  // crosses: what failed

struct Series {
  std::string label;  // empty: not in the key
  int style = 0;      // colour and marker, from 0; the same thing has the same in every plot of a page
  std::vector<std::pair<double, double>> points;
  Mark mark = Mark::line_and_points;
};

struct Plot {
  std::string title;
  Axis x;
  Axis y;
  std::vector<Series> series;
  std::vector<std::string> commands;  // of gnuplot, before the series are drawn: labels, arrows, objects
};

/// Writes FOLDER/NAME.svg, and NAME.png with `png`. Throws std::runtime_error with gnuplot's own words where it fails.
void draw(const Plot& plot, const std::filesystem::path& folder, const std::string& name, bool png);

/// The colour of a style, "#0072B2".
[[nodiscard]] std::string colour(int style);

}  // namespace pneuma::report
