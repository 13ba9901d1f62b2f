// The frames of a recording, decoded: from the start on, or from any time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "base/status.h"
#include "pneuma_client/frames.h"
#include "pneuma_client/recording.h"

namespace pneuma::client {

struct RecordedFrame {
  double at_s = 0.0;  // play time: from the recording's first frame on
  DecodedFrame frame;
};

/// What a recording holds, in the order in which it was received.
using Recorded = std::variant<RecordedFrame, v1::Gap, v1::Event, v1::Applied>;

class Playback {
 public:
  [[nodiscard]] static base::Result<Playback> open(const std::string& path);

  [[nodiscard]] const v1::RecordingHeader& header() const { return reader_.header(); }
  [[nodiscard]] const v1::RecordingIndex& index() const { return reader_.index(); }
  /// Why the recording ends before its end; OK where it is whole.
  [[nodiscard]] const base::Status& damage() const { return reader_.damage(); }

  /// The next one; nothing at the end. Errors name the file's byte.
  [[nodiscard]] base::Result<std::optional<Recorded>> next();
  /// The last frame that is not later than `at_s` (of several at one time the last one; before the start, the first) is
  /// the next one. Decodes from the key frame before it on.
  [[nodiscard]] base::Status seek(double at_s);
  /// The first message is the next one.
  [[nodiscard]] base::Status rewind();

  /// Frames decoded so far.
  [[nodiscard]] std::uint64_t frames_decoded() const { return frames_decoded_; }

 private:
  explicit Playback(RecordingReader reader);

  [[nodiscard]] base::Status begin();
  [[nodiscard]] base::Result<std::optional<Recorded>> decode(const RecordingReader::Record& record);
  [[nodiscard]] base::Result<RecordingReader::Record> read_at(std::uint64_t offset);

  RecordingReader reader_;
  StreamDecoder decoder_;
  PlayTime play_time_;
  std::optional<Recorded> found_;  // by seek(): the next one
  std::uint64_t frames_decoded_ = 0;
};

}  // namespace pneuma::client
