// What a soak notes, and what it says of a server.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace pneuma::soak {

struct Sample {
  double at_s = 0.0;
  double resident_mib = 0.0;
  double descriptors = 0.0;
  double time_ratio = 0.0;  // of the light world
  double late_ms = 0.0;     // likewise: the 99th percentile of its ticks in the last seconds
  double sessions = 0.0;    // so far
  double edits = 0.0;       // likewise
};

inline constexpr const char* sample_columns = "at_s,resident_mib,descriptors,time_ratio,late_ms,sessions,edits";
[[nodiscard]] std::string csv_line(const Sample& sample);
/// Throws std::runtime_error naming the file where it is none of sample_columns.
[[nodiscard]] std::vector<Sample> read_samples(const std::filesystem::path& csv);

/// Of what comes after the first ten minutes: until then caches and allocators fill.
struct Verdict {
  double minutes = 0.0;
  double growth_mib_h = 0.0;          // least squares, of resident memory
  double growth_error_mib_h = 0.0;    // its standard error
  double descriptors_growth_h = 0.0;  // likewise, of descriptors
  double time_ratio_median = 0.0;
  double late_ms_median = 0.0;
  double late_ms_worst = 0.0;

  static constexpr double growth_max_mib_h = 1.0;
  static constexpr double descriptors_growth_max_h = 2.0;
  static constexpr double time_ratio_min = 0.99;
  /// Growth counts where it is told from noise.
  [[nodiscard]] bool holds() const {
    return growth_mib_h - 2.0 * growth_error_mib_h <= growth_max_mib_h &&
           descriptors_growth_h <= descriptors_growth_max_h && time_ratio_median >= time_ratio_min;
  }
};
[[nodiscard]] Verdict judge(std::span<const Sample> samples);
[[nodiscard]] std::string describe(const Verdict& verdict);

}  // namespace pneuma::soak
