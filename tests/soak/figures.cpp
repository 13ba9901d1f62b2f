#include "soak/figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace pneuma::soak {
namespace {

constexpr double settled_s = 600.0;

struct Line {
  double slope = 0.0;
  double slope_error = 0.0;
};

// Least squares.
Line line_through(std::span<const Sample> samples, double Sample::* value) {
  const auto count = static_cast<double>(samples.size());
  if (samples.size() < 3) return {};
  double mean_at = 0.0;
  double mean = 0.0;
  for (const Sample& sample : samples) {
    mean_at += sample.at_s / count;
    mean += sample.*value / count;
  }
  double squares = 0.0;
  double products = 0.0;
  for (const Sample& sample : samples) {
    squares += (sample.at_s - mean_at) * (sample.at_s - mean_at);
    products += (sample.at_s - mean_at) * (sample.*value - mean);
  }
  const double slope = products / squares;
  double left = 0.0;
  for (const Sample& sample : samples) {
    left += std::pow(sample.*value - mean - slope * (sample.at_s - mean_at), 2.0);
  }
  return {slope, std::sqrt(left / (count - 2.0) / squares)};
}

double quantile(std::span<const Sample> samples, double Sample::* value, double share) {
  std::vector<double> sorted;
  for (const Sample& sample : samples) sorted.push_back(sample.*value);
  std::ranges::sort(sorted);
  return sorted.empty() ? 0.0 : sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

}  // namespace

std::string csv_line(const Sample& sample) {
  std::ostringstream line;
  line << sample.at_s << ',' << sample.resident_mib << ',' << sample.descriptors << ',' << sample.time_ratio << ','
       << sample.late_ms << ',' << sample.sessions << ',' << sample.edits;
  return line.str();
}

std::vector<Sample> read_samples(const std::filesystem::path& csv) {
  std::ifstream file(csv);
  std::string line;
  if (!std::getline(file, line) || line != sample_columns) throw std::runtime_error(csv.string() + " has no samples");
  std::vector<Sample> samples;
  while (std::getline(file, line)) {
    std::ranges::replace(line, ',', ' ');
    std::istringstream numbers(line);
    Sample sample;
    numbers >> sample.at_s >> sample.resident_mib >> sample.descriptors >> sample.time_ratio >> sample.late_ms >>
        sample.sessions >> sample.edits;
    if (!numbers) throw std::runtime_error(csv.string() + ": \"" + line + "\" is no sample");
    samples.push_back(sample);
  }
  return samples;
}

Verdict judge(std::span<const Sample> samples) {
  const auto settled = std::ranges::find_if(samples, [](const Sample& sample) { return sample.at_s >= settled_s; });
  const std::span<const Sample> rest = samples.subspan(static_cast<std::size_t>(settled - samples.begin()));
  constexpr double hour_s = 3600.0;
  const Line memory = line_through(rest, &Sample::resident_mib);
  return {.minutes = samples.empty() ? 0.0 : samples.back().at_s / 60.0,
          .growth_mib_h = hour_s * memory.slope,
          .growth_error_mib_h = hour_s * memory.slope_error,
          .descriptors_growth_h = hour_s * line_through(rest, &Sample::descriptors).slope,
          .time_ratio_median = quantile(rest, &Sample::time_ratio, 0.5),
          .late_ms_median = quantile(rest, &Sample::late_ms, 0.5),
          .late_ms_worst = quantile(rest, &Sample::late_ms, 1.0)};
}

std::string describe(const Verdict& verdict) {
  std::array<char, 320> text{};
  std::snprintf(text.data(), text.size(),
                "%.0f minutes; after the first ten, resident memory grew by %.2f MiB an hour (standard error %.2f), "
                "descriptors by %.1f; the light world ran at %.3f of its rate, its ticks' 99th percentile %.1f ms late "
                "(median; at most %.1f)",
                verdict.minutes, verdict.growth_mib_h, verdict.growth_error_mib_h, verdict.descriptors_growth_h,
                verdict.time_ratio_median, verdict.late_ms_median, verdict.late_ms_worst);
  return text.data();
}

}  // namespace pneuma::soak
