#include "bench/recorded_ticks.h"

#include <memory>
#include <utility>

#include "app/frame_hub.h"
#include "app/live_world.h"
#include "pneuma_client/recording.h"

namespace pneuma::bench {

namespace {

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

}  // namespace

base::Status record_ticks(const v1::Scene& scene, std::uint64_t ticks, const std::string& path) {
  constexpr double rate_hz = 60.0;
  auto live = app::LiveWorld::create(scene);
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
  for (std::uint64_t tick = 1; tick <= ticks; ++tick) {
    live->physics().step_tick(one_thread);
    app::Outbox outbox;
    hub.encode_tick(app::LiveFrames(live->physics()), tick, false, outbox);
    if (base::Status appended = append_all(*writer, outbox); !appended.ok()) return appended;
  }
  return writer->finish();
}

}  // namespace pneuma::bench
