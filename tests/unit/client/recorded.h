// A recording of a test's own making: the body of fake_server.h, moved one grid step a frame.
#pragma once

#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "pneuma_client/recording.h"
#include "unit/client/fake_server.h"

namespace pneuma::client {

constexpr std::uint32_t recorded_stream = 3;

inline std::string contents(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline v1::RecordingHeader recording_header() {
  v1::RecordingHeader header;
  header.set_world("w");
  header.set_world_rate_hz(60.0);
  header.mutable_scene()->set_name("scene");
  v1::ServerMessage message;
  fill_subscribed(recorded_stream, message);
  *header.mutable_stream() = message.subscribed();
  header.mutable_stream()->set_max_error_m(1e-3);
  return header;
}

inline void append(RecordingWriter& writer, const v1::ServerMessage& message) {
  ASSERT_TRUE(writer.append(message.SerializeAsString(), message).ok());
}

/// Frames of ticks 1 to `frames`, every `key_every`-th a key frame, the first too. Vertex 0 is `tick` grid steps from
/// its place. An impulse was applied before tick 3.
inline void write_frames(RecordingWriter& writer, std::uint64_t frames, std::uint64_t key_every) {
  append(writer, topology_message());
  append(writer, layout_message(recorded_stream));
  for (std::uint64_t tick = 1; tick <= frames; ++tick) {
    const auto offset = static_cast<std::int64_t>(tick);
    if (tick == 3) {
      v1::ServerMessage applied;
      applied.mutable_applied()->set_stream_id(recorded_stream);
      applied.mutable_applied()->set_tick(2);
      applied.mutable_applied()->mutable_command()->mutable_impulse()->set_body("ball");
      append(writer, applied);
    }
    v1::ServerMessage message = (tick - 1) % key_every == 0
                                    ? key_frame(recorded_stream, tick, offset)
                                    : delta_frame(recorded_stream, tick, tick - 1, offset, offset - 1);
    append(writer, message);
  }
}

/// A whole one at `path`.
inline void write_recording(const std::string& path, std::uint64_t frames, std::uint64_t key_every) {
  auto writer = RecordingWriter::create(path, recording_header(), RecordingWriter::IfThere::replace);
  ASSERT_TRUE(writer.ok()) << writer.status().message();
  write_frames(*writer, frames, key_every);
  ASSERT_TRUE(writer->finish().ok());
}

}  // namespace pneuma::client
