#include "pneuma_client/playback.h"

#include <algorithm>
#include <utility>

namespace pneuma::client {

namespace {

// Frames' times are sums: one that is meant to be at the time sought may be this much behind it.
constexpr double rounding_s = 1e-6;

}  // namespace

base::Result<Playback> Playback::open(const std::string& path) {
  auto reader = RecordingReader::open(path);
  if (!reader.ok()) return reader.status();
  Playback playback(std::move(*reader));
  // All meshes at once: a late layout may name one of long ago.
  for (const std::uint64_t offset : playback.index().topology_offsets()) {
    const auto record = playback.read_at(offset);
    if (!record.ok()) return record.status();
    const base::Status taken = playback.decoder_.take_topology(record->message.topology());
    if (!taken.ok()) return taken.inside(path);
  }
  if (base::Status begun = playback.rewind(); !begun.ok()) return begun;
  return playback;
}

Playback::Playback(RecordingReader reader) : reader_(std::move(reader)), play_time_(reader_.header()) {}

/// Forgets all frames, but not the meshes.
base::Status Playback::begin() {
  decoder_ = StreamDecoder(decoder_.topologies());
  play_time_ = PlayTime(header());
  found_.reset();
  return decoder_.add_stream(header().stream());
}

base::Status Playback::rewind() {
  reader_.rewind();
  return begin();
}

base::Result<std::optional<Recorded>> Playback::next() {
  if (found_) return std::exchange(found_, std::nullopt);
  while (true) {
    const auto record = reader_.next();
    if (!record.ok()) return record.status();
    if (!*record) return std::optional<Recorded>();
    auto recorded = decode(**record);
    if (!recorded.ok() || *recorded) return recorded;
  }
}

base::Result<std::optional<Recorded>> Playback::decode(const RecordingReader::Record& record) {
  const v1::ServerMessage& message = record.message;
  const auto at_byte = [&](const base::Status& status) {
    return base::Status(status.code(), status.message(), "byte " + std::to_string(record.offset));
  };
  switch (message.message_case()) {
    case v1::ServerMessage::kTopology: {
      const base::Status taken = decoder_.take_topology(message.topology());
      if (!taken.ok()) return at_byte(taken);
      return std::optional<Recorded>();
    }
    case v1::ServerMessage::kLayout: {
      const base::Status taken = decoder_.take_layout(message.layout());
      if (!taken.ok()) return at_byte(taken);
      return std::optional<Recorded>();
    }
    case v1::ServerMessage::kFrame: {
      const double at_s = play_time_.take(message.frame());
      auto frame = decoder_.take_frame(message.frame(), record.bytes);
      if (!frame.ok()) return at_byte(frame.status());
      if (!*frame) return std::optional<Recorded>();
      ++frames_decoded_;
      return std::optional<Recorded>(RecordedFrame{at_s, std::move(**frame)});
    }
    case v1::ServerMessage::kGap:
      return std::optional<Recorded>(message.gap());
    case v1::ServerMessage::kEvent:
      return std::optional<Recorded>(message.event());
    case v1::ServerMessage::kApplied:
      return std::optional<Recorded>(message.applied());
    default:
      return std::optional<Recorded>();  // of a newer server
  }
}

base::Result<RecordingReader::Record> Playback::read_at(std::uint64_t offset) {
  reader_.go_to(offset);
  auto record = reader_.next();
  if (!record.ok()) return record.status();
  if (!*record) return base::Status(base::StatusCode::malformed, "the index names what is not there");
  return std::move(**record);
}

base::Status Playback::seek(double at_s) {
  const auto& keys = index().keys();
  if (keys.empty()) return base::not_found("the recording holds no frame");
  at_s += rounding_s;
  // The last key frame at or before that time.
  const auto behind = std::ranges::upper_bound(keys, at_s, {}, [](const auto& one) { return one.at_s(); });
  const v1::RecordingIndex::Key& key = behind == keys.begin() ? *behind : *std::prev(behind);

  if (base::Status begun = begin(); !begun.ok()) return begun;
  const auto layout = read_at(key.layout_offset());
  if (!layout.ok()) return layout.status();
  if (base::Status taken = decoder_.take_layout(layout->message.layout()); !taken.ok()) return taken;
  const auto first = read_at(key.offset());
  if (!first.ok()) return first.status();
  auto frame = decode(*first);
  if (!frame.ok()) return frame.status();
  if (!*frame || !std::holds_alternative<RecordedFrame>(**frame)) {
    return {base::StatusCode::malformed, "the index names what is no frame"};
  }
  std::get<RecordedFrame>(**frame).at_s = key.at_s();
  found_ = std::move(**frame);
  play_time_.start(first->message.frame(), key.at_s());

  while (true) {
    const std::uint64_t here = reader_.position();
    const auto record = reader_.next();
    if (!record.ok() || !*record) return {};  // the end, of which next() tells
    const v1::ServerMessage& message = (*record)->message;
    if (message.has_frame() && PlayTime(play_time_).take(message.frame()) > at_s) {
      reader_.go_to(here);
      return {};
    }
    auto recorded = decode(**record);
    if (!recorded.ok()) return recorded.status();
    if (*recorded && std::holds_alternative<RecordedFrame>(**recorded)) found_ = std::move(**recorded);
  }
}

}  // namespace pneuma::client
