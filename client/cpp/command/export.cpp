// `pneuma export`: a recording's soft bodies in the file formats of others.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "command/commands.h"
#include "command/interrupt.h"
#include "command/json.h"
#include "command/progress.h"
#include "formats/exporter.h"

namespace pneuma::client {

namespace {

using Clock = std::chrono::steady_clock;

base::Result<std::unique_ptr<Exporter>> make_exporter(const std::string& format, const ExportPlan& plan) {
  if (format == "obj") return export_obj(plan);
  if (format == "pc2") return export_pc2(plan);
  if (format == "usda") return export_usda(plan);
  return export_gltf(plan);
}

Progress::State state_of(const ExportArguments& arguments, const char* type, std::size_t done, const Sampler& sampler) {
  Progress::State state;
  state.fraction = static_cast<double>(done) / static_cast<double>(sampler.count());
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "%zu of %zu frames at %.6g Hz", done, sampler.count(), sampler.rate_hz());
  state.text = text.data();
  state.json.add("type", type)
      .add("out", arguments.out)
      .add("frames", std::uint64_t{done})
      .add("of", std::uint64_t{sampler.count()})
      .add("rate_hz", sampler.rate_hz());
  return state;
}

/// Nothing that is there is lost unasked, and never the recording itself.
base::Status check_place(const ExportArguments& arguments) {
  namespace fs = std::filesystem;
  const fs::path out = arguments.out;
  std::error_code error;
  if (fs::equivalent(arguments.file, out, error)) return base::invalid("is the recording itself", "--out");
  const bool is_folder = fs::is_directory(out, error);
  const bool has_room = !fs::exists(out, error) || (is_folder && fs::is_empty(out, error));
  if (!has_room && !arguments.force) {
    return {base::StatusCode::already_exists, "is there already; --force replaces it", arguments.out};
  }
  if (arguments.format == "obj" || arguments.format == "pc2") return {};
  if (is_folder) return base::invalid("is a folder", "--out");
  const fs::path folder = out.has_parent_path() ? out.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, error)) return base::not_found("no such folder", folder.string());
  return {};
}

/// As often as the recording's own frames, but no more than the format takes.
base::Result<Sampler> start_sampler(Playback& playback, const ExportArguments& arguments) {
  SampleRange range = arguments.range;
  auto sampler = Sampler::start(playback, range);
  if (!sampler.ok() || arguments.format != "gltf" || sampler->count() <= gltf_samples_max) return sampler;
  if (range.rate_hz > 0.0) {
    return base::Status(base::StatusCode::limit_exceeded,
                        "would make " + std::to_string(sampler->count()) + " frames; a glTF file holds at most " +
                            std::to_string(gltf_samples_max),
                        "--rate");
  }
  const double share = static_cast<double>(gltf_samples_max - 1) / static_cast<double>(sampler->count() - 1);
  range.rate_hz = sampler->rate_hz() * share;
  return Sampler::start(playback, range);
}

}  // namespace

base::Status export_recording(FileSession& session, const ExportArguments& arguments) {
  catch_interrupts();
  auto playback = Playback::open(arguments.file);
  if (!playback.ok()) return playback.status();
  tell_damage(*playback);
  if (base::Status wrong = check_place(arguments); !wrong.ok()) return wrong;
  auto sampler = start_sampler(*playback, arguments);
  if (!sampler.ok()) return sampler.status();
  auto exporter = make_exporter(arguments.format, {arguments.out, sampler->rate_hz(), sampler->count()});
  if (!exporter.ok()) return exporter.status();

  Progress progress(session.output, Progress::form_for(session.json), Clock::now());
  std::size_t done = 0;
  while (true) {
    const auto sample = sampler->next();
    if (!sample.ok()) return sample.status();
    if (!*sample) break;
    if (interrupted()) return {base::StatusCode::unavailable, "interrupted: what is there is not whole", arguments.out};
    if (base::Status added = (*exporter)->add(**sample); !added.ok()) return added;
    ++done;
    if (const auto now = Clock::now(); progress.due(now)) {
      const base::Status shown = progress.show(now, state_of(arguments, "progress", done, *sampler));
      if (!shown.ok()) return shown;
    }
  }
  if (base::Status finished = (*exporter)->finish(); !finished.ok()) return finished;
  progress.clear();
  const Progress::State end = state_of(arguments, "export", done, *sampler);
  return session.output.line(session.json ? end.json.text() : arguments.out + ": " + end.text);
}

}  // namespace pneuma::client
