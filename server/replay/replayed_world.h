// A recording as the world that it was: its frames come when they are due, to any number of subscribers. Knows no
// thread; the time is passed in.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "app/frame_hub.h"
#include "app/inbox.h"
#include "app/outbox.h"
#include "app/world_status.h"
#include "base/status.h"
#include "pneuma/v1/session.pb.h"
#include "pneuma_client/playback.h"
#include "replay/recorded_frames.h"

namespace pneuma::replay {

struct PlayOptions {
  double speed = 1.0;    // play time over real time
  bool loop = false;     // begin again at the end
  double start_s = 0.0;  // play time
  bool paused = false;   // at first
};

/// Refuses a time that is not one of a recording of that length.
[[nodiscard]] base::Status check_seek(const v1::Seek& seek, double duration_s);

class ReplayedWorld {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  struct Wiring {
    std::function<std::uint32_t()> take_stream_id;
    std::function<void(std::uint32_t)> drop_stream_id;
    app::MeshTopologies::Defer defer = [](std::size_t /*vertices*/, const auto& make) { make(); };
  };

  ReplayedWorld(client::Playback playback, const PlayOptions& options, Wiring wiring);

  /// Shows the frame at the start.
  [[nodiscard]] base::Status begin(TimePoint now);

  // Any thread:

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] app::Inbox::Post post(app::Command command) { return inbox_.post(std::move(command)); }
  [[nodiscard]] app::WorldStatus status() const;
  [[nodiscard]] double duration_s() const { return duration_s_; }
  [[nodiscard]] double play_time_s() const;

  // One thread:

  /// Carries out what came.
  void drain(TimePoint now, app::Outbox& outbox);
  /// When the next frame is; nothing while paused or at the end.
  [[nodiscard]] std::optional<TimePoint> due() const;
  /// Shows the frame that is due.
  void play(TimePoint now, app::Outbox& outbox);
  /// Takes no more requests; those that wait are answered with `why`.
  void close(const base::Status& why, app::Outbox& outbox);

 private:
  using Answer = base::Result<v1::ServerMessage>;

  [[nodiscard]] Answer carry_out(const app::Request& request, TimePoint now, app::Outbox& outbox);
  [[nodiscard]] Answer subscribe(const app::Request& request);
  [[nodiscard]] Answer resume(const v1::ClientMessage& message, TimePoint now);
  [[nodiscard]] Answer step(const v1::ClientMessage& message, app::Outbox& outbox);
  [[nodiscard]] base::Status go_to(double at_s, TimePoint now);
  [[nodiscard]] v1::ServerMessage done(const v1::ClientMessage& message) const;
  [[nodiscard]] v1::ServerMessage stats(const app::Request& request) const;
  [[nodiscard]] v1::WorldList::Recording recording() const;

  /// Reads on to the next frame; `next_` is empty at the end.
  void read_on();
  /// The next frame becomes the one that is shown.
  void advance(app::Outbox& outbox);
  /// Frames for whoever waits for one; for all where it is not the one after the last.
  void show_at_rest(app::Outbox& outbox);
  void halt(const base::Status& why);
  /// Play time `at_s` is now.
  void start_clock(TimePoint now, double at_s);
  void publish_status(TimePoint now);
  [[nodiscard]] std::uint64_t tick() const { return shown_.frame().tick; }

  const std::string name_;
  const PlayOptions options_;
  const double duration_s_;
  app::Inbox inbox_;
  client::Playback playback_;
  RecordedFrames shown_;
  double shown_at_s_ = 0.0;  // play time
  app::FrameHub hub_;

  std::optional<client::RecordedFrame> next_;
  std::vector<client::Recorded> before_next_;  // events and changes, told when it is shown
  bool paused_;
  double speed_;       // play time over real time
  bool moved_ = true;  // to another frame than the next one
  // Play time goes on from here:
  TimePoint clock_start_{};
  double clock_start_s_ = 0.0;

  mutable std::mutex status_mutex_;
  app::WorldStatus status_;
  double status_at_s_ = 0.0;
};

}  // namespace pneuma::replay
