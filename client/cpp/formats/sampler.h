// The soft bodies of a recording at even times, for file formats that know a frame rate.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/status.h"
#include "pneuma_client/playback.h"

namespace pneuma::client {

struct SampleRange {
  double from_s = 0.0;         // play time
  std::optional<double> to_s;  // none: the recording's end
  double rate_hz = 0.0;        // 0: the recording's
  std::string body;            // empty: all of them
};

struct Sample {
  std::size_t index = 0;
  double at_s = 0.0;  // play time
  std::vector<SoftBodyFrame> bodies;
};

class Sampler {
 public:
  /// Errors say which part of the range is not in the recording. `playback` must outlive the sampler.
  [[nodiscard]] static base::Result<Sampler> start(Playback& playback, const SampleRange& range);

  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  [[nodiscard]] std::size_t count() const { return count_; }

  /// The next sample, its vertices between those of the frames before and after it; nothing after the last one. Where
  /// bodies come, go or get another mesh, it is the frame before.
  [[nodiscard]] base::Result<std::optional<Sample>> next();

 private:
  Sampler(Playback& playback, const SampleRange& range) : playback_(&playback), body_(range.body) {}

  [[nodiscard]] base::Status read_on();
  void drop_other_bodies(RecordedFrame& frame) const;

  Playback* playback_;
  std::string body_;
  double from_s_ = 0.0;
  double rate_hz_ = 0.0;
  std::size_t count_ = 0;
  std::size_t index_ = 0;
  RecordedFrame before_;
  std::optional<RecordedFrame> after_;  // none: `before_` is the last one
};

/// The same bodies of the same meshes.
[[nodiscard]] bool same_bodies(const std::vector<SoftBodyFrame>& a, const std::vector<SoftBodyFrame>& b);

}  // namespace pneuma::client
