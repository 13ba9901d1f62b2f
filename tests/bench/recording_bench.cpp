// What it takes to go to any time of a recording: a minute of five-balls, a key frame a second, as `pneuma record`
// makes it, sought at times that have nothing to do with each other.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include <benchmark/benchmark.h>

#include "app/frame_hub.h"
#include "app/live_world.h"
#include "bench/figures.h"
#include "pneuma_client/playback.h"
#include "scene_io/load.h"
#include "support/temporary_folder.h"

namespace pneuma::bench {

namespace {

constexpr std::uint64_t recorded_ticks = 3'600;
constexpr double rate_hz = 60.0;

/// What a subscriber is sent who takes all at once.
base::Status append_all(client::RecordingWriter& writer, const app::Outbox& outbox) {
  for (const auto& item : outbox.items) {
    net::SharedBytes bytes;
    if (const auto* send = std::get_if<app::Outbox::Send>(&item)) bytes = send->message;
    if (const auto* missing = std::get_if<app::Outbox::SendTopology>(&item)) bytes = missing->topology.message;
    if (const auto* publish = std::get_if<app::Outbox::Publish>(&item)) {
      bytes = publish->frame.delta != nullptr ? publish->frame.delta : publish->frame.key;
    }
    v1::ServerMessage message;
    if (bytes == nullptr || !message.ParseFromString(*bytes)) continue;
    if (base::Status appended = writer.append(*bytes, message); !appended.ok()) return appended;
  }
  return {};
}

base::Status record_minute(const std::string& path) {
  auto live = app::LiveWorld::create(*scene_io::load_scene("five-balls"));
  if (!live.ok()) return live.status();
  app::FrameHub hub([] { return 1U; }, [](std::uint32_t) {});
  v1::Subscribe request;
  request.set_key_interval_s(1.0);
  const auto subscribed = hub.subscribe(std::make_shared<app::Session>(1), request, rate_hz);
  if (!subscribed.ok()) return subscribed.status();
  v1::RecordingHeader header;
  header.set_world_rate_hz(rate_hz);
  *header.mutable_stream() = *subscribed;
  auto writer = client::RecordingWriter::create(path, header, client::RecordingWriter::IfThere::refuse);
  if (!writer.ok()) return writer.status();
  physics::Workers one_thread(1);
  for (std::uint64_t tick = 1; tick <= recorded_ticks; ++tick) {
    live->physics().step_tick(one_thread);
    app::Outbox outbox;
    hub.encode_tick(app::LiveFrames(live->physics()), tick, false, outbox);
    if (base::Status appended = append_all(*writer, outbox); !appended.ok()) return appended;
  }
  return writer->finish();
}

void recording_seek(benchmark::State& bench) {
  const support::TemporaryFolder folder;
  const std::string path = folder / "minute.pneuma";
  if (const base::Status recorded = record_minute(path); !recorded.ok()) {
    return bench.SkipWithError(recorded.message().c_str());
  }
  auto playback = client::Playback::open(path);
  if (!playback.ok()) return bench.SkipWithError(playback.status().message().c_str());
  constexpr double golden_ratio = 0.6180339887498949;  // its multiples' fractions are nowhere near each other
  double place = 0.0;
  double slowest_ms = 0.0;
  for ([[maybe_unused]] auto _ : bench) {
    place = std::fmod(place + golden_ratio, 1.0);
    const auto start = std::chrono::steady_clock::now();
    const base::Status found = playback->seek(place * playback->index().duration_s());
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    if (!found.ok()) return bench.SkipWithError(found.message().c_str());
    slowest_ms = std::max(slowest_ms, took.count());
  }
  bench.counters["slowest_ms"] = slowest_ms;
}
BENCHMARK(recording_seek)->Iterations(500)->Unit(benchmark::kMillisecond);

[[maybe_unused]] const bool recording_listed = expect({"recording_seek/", "slowest_ms", Bound::at_most, 50.0,
                                                       "a seek in a minute of five-balls, the slowest of 500, ms"});

}  // namespace

}  // namespace pneuma::bench
