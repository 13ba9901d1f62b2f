#include "numerics/report/plot.h"

#include <array>
#include <cstdio>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace pneuma::report {
namespace {

struct LineStyle {
  const char* colour;
  int marker;  // of gnuplot: filled and open ones in turn
  int dash;
};
constexpr std::array<LineStyle, 10> styles{{{"#000000", 7, 1},
                                            {"#0072B2", 5, 1},
                                            {"#D55E00", 9, 1},
                                            {"#009E73", 11, 1},
                                            {"#CC79A7", 13, 1},
                                            {"#E69F00", 6, 2},
                                            {"#56B4E9", 4, 2},
                                            {"#7A5C00", 8, 2},
                                            {"#606060", 10, 2},
                                            {"#8B2FC9", 12, 2}}};

const LineStyle& line_style(int style) {
  return styles.at(static_cast<std::size_t>(style) % styles.size());
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

void set_axis(std::ostream& script, char axis, const Axis& as) {
  script << "set " << axis << "label " << quoted(as.label) << (axis == 'x' ? " offset 0,0.4" : "") << '\n';
  if (as.log) script << "set logscale " << axis << "\nset format " << axis << " '10^{%L}'\n";
  if (as.range.first != as.range.second) {
    script << "set " << axis << "range [" << as.range.first << ':' << as.range.second << "]\n";
  }
}

std::string_view with(Mark mark) {
  switch (mark) {
    case Mark::points:
    case Mark::circles:
    case Mark::crosses:
      return "points";
    case Mark::line:
    case Mark::dashed:
      return "lines";
    case Mark::line_and_points:
      return "linespoints";
  }
  return "";
}

// gnuplot's number of it.
std::optional<int> marker_of(const Series& series) {
  switch (series.mark) {
    case Mark::line_and_points:
    case Mark::points:
      return line_style(series.style).marker;
    case Mark::circles:
      return 6;
    case Mark::crosses:
      return 2;
    case Mark::line:
    case Mark::dashed:
      break;
  }
  return std::nullopt;
}

void write_series(std::ostream& script, const Plot& plot) {
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    script << "$series" << i << " << END\n";
    for (const auto& [x, y] : plot.series[i].points) script << x << ' ' << y << '\n';
    script << "END\n";
  }
  script << "plot ";
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const Series& series = plot.series[i];
    const LineStyle& style = line_style(series.style);
    script << (i == 0 ? "" : ", \\\n     ") << "$series" << i << " with " << with(series.mark) << " lc rgb '"
           << style.colour << "' lw 2";
    const std::optional<int> marker = marker_of(series);
    if (with(series.mark) != "points") script << " dt " << (series.mark == Mark::dashed ? 2 : style.dash);
    if (marker) script << " pt " << *marker << " ps 1";
    script << (series.label.empty() ? " notitle" : " title " + quoted(series.label));
  }
  script << '\n';
}

std::string script_of(const Plot& plot, const std::filesystem::path& file, bool png) {
  std::ostringstream script;
  script.precision(12);
  script << (png ? "set terminal pngcairo size 960,1120 font 'sans,12' fontscale 2 linewidth 2 pointscale 2 "
                   "background '#ffffff'\n"
                 : "set terminal svg size 480,560 dynamic font 'sans-serif,16' background '#ffffff'\n");
  script << "set output " << quoted(file.string()) << '\n'
         << "set encoding utf8\n"
            "set border 3 lc rgb '#404040'\nset tics nomirror\nset grid lc rgb '#d8d8d8' lw 1 dt 1\n"
            "set key outside below center horizontal maxcols 2 Left reverse samplen 2.5 width -3 height 1\n"
            "set style textbox opaque fillcolor '#60ffffff' noborder margins 0.3,0.3\n"
         << "set title " << quoted(plot.title) << '\n';
  set_axis(script, 'x', plot.x);
  set_axis(script, 'y', plot.y);
  for (const std::string& command : plot.commands) script << command << '\n';
  write_series(script, plot);
  return script.str();
}

void run_gnuplot(const std::string& script, const std::filesystem::path& script_file) {
  std::ofstream(script_file) << script;
  const std::string command = "gnuplot " + quoted(script_file.string()) + " 2>&1";
  const auto close = [](std::FILE* pipe) { return pclose(pipe); };
  std::string words;
  int status = 0;
  {
    std::FILE* pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) throw std::runtime_error("gnuplot: cannot be started");
    std::array<char, 256> line{};
    while (std::fgets(line.data(), static_cast<int>(line.size()), pipe) != nullptr) words += line.data();
    status = close(pipe);
  }
  if (status != 0) throw std::runtime_error("gnuplot, on " + script_file.string() + ": " + words);
  std::filesystem::remove(script_file);
}

}  // namespace

std::string colour(int style) {
  return line_style(style).colour;
}

void draw(const Plot& plot, const std::filesystem::path& folder, const std::string& name, bool png) {
  std::filesystem::create_directories(folder);
  const std::filesystem::path script_file = folder / (name + ".gp");
  run_gnuplot(script_of(plot, folder / (name + ".svg"), false), script_file);
  if (png) run_gnuplot(script_of(plot, folder / (name + ".png"), true), script_file);
}

}  // namespace pneuma::report
