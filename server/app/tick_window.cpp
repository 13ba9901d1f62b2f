#include "app/tick_window.h"

#include <algorithm>
#include <vector>

namespace pneuma::app {

namespace {

/// The value below which a share `q` of `values` lies (nearest rank); 0 where there is none.
double quantile(std::vector<double>& values, double q) {
  if (values.empty()) return 0.0;
  const auto rank = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

}  // namespace

void TickWindow::add(TimePoint now, const TickSample& sample) {
  entries_.push_back({now, sample});
  while (entries_.front().at + length < now) entries_.pop_front();
}

TickSummary TickWindow::summary(TimePoint now) const {
  TickSummary summary;
  std::vector<double> steps;
  std::vector<double> encodes;
  std::vector<double> due_errors;
  double periods_s = 0.0;
  double slipped_s = 0.0;
  for (const Entry& entry : entries_) {
    const bool last = &entry == &entries_.back();  // counts however long ago: a tick can outlast the window
    if (entry.at + length < now && !last) continue;
    due_errors.push_back(entry.sample.due_error_ms);
    if (entry.at + std::chrono::seconds(1) < now && !last) continue;
    steps.push_back(entry.sample.step_ms);
    encodes.push_back(entry.sample.encode_ms);
    periods_s += entry.sample.period_s;
    slipped_s += entry.sample.slipped_s;
  }
  if (periods_s > 0.0) summary.time_ratio = periods_s / (periods_s + slipped_s);
  if (!steps.empty()) summary.step_ms_max = *std::max_element(steps.begin(), steps.end());
  summary.step_ms_median = quantile(steps, 0.5);
  summary.encode_ms_median = quantile(encodes, 0.5);
  summary.due_error_ms_p99 = quantile(due_errors, 0.99);
  return summary;
}

}  // namespace pneuma::app
