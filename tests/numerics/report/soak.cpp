#include <filesystem>
#include <utility>
#include <vector>

#include "numerics/report/part.h"
#include "soak/figures.h"

namespace pneuma::report {
namespace {

void run_soak(Context& context) {
  const std::filesystem::path noted = PNEUMA_SOAK_SAMPLES;
  if (!std::filesystem::exists(noted)) return;
  const std::vector<soak::Sample> samples = soak::read_samples(noted);
  context.page.heading("Hours among clients");
  context.page.paragraph(
      "A server with a data folder ran among clients that watch, edit, make and end worlds, and misbehave: bytes "
      "without meaning, half messages, requests and streams that nobody reads (`./dev soak`; this part is drawn from "
      "what the last one noted). " +
      soak::describe(soak::judge(samples)) + ".");
  Series resident{.label = "resident memory (MiB)", .style = 0, .points = {}, .mark = Mark::line};
  Series descriptors{.label = "descriptors", .style = 1, .points = {}, .mark = Mark::line};
  Series late{.label = "ms late (99th percentile)", .style = 2, .points = {}, .mark = Mark::line};
  for (const soak::Sample& sample : samples) {
    const double minutes = sample.at_s / 60.0;
    resident.points.emplace_back(minutes, sample.resident_mib);
    descriptors.points.emplace_back(minutes, sample.descriptors);
    late.points.emplace_back(minutes, sample.late_ms);
  }
  context.figure("soak",
                 {.title = "A server among clients",
                  .x = {.label = "time (minutes)"},
                  .y = {.label = "MiB, descriptors, ms"},
                  .series = {std::move(resident), std::move(descriptors), std::move(late)},
                  .commands = {}},
                 "Resident memory, open descriptors, and how late the ticks of the light world ended.");
}

}  // namespace

Part soak() {
  return {.name = "soak", .title = "hours among clients", .quick_s = 0.5, .full_s = 0.5, .run = run_soak};
}

}  // namespace pneuma::report
