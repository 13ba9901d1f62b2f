// A world's subscribers and their frames: encoded once a tick for all subscribers of the same quality.
// Called by the thread that steps the world.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/frame_source.h"
#include "app/layered_encoder.h"
#include "app/layout.h"
#include "app/outbox.h"
#include "app/session.h"
#include "base/status.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

class FrameHub {
 public:
  /// `take_stream_id` gives an id that no other stream of the server has; `drop_stream_id` hears of the ones that
  /// ended; `defer` makes coarser meshes, by default at once.
  FrameHub(
      std::function<std::uint32_t()> take_stream_id, std::function<void(std::uint32_t)> drop_stream_id,
      MeshTopologies::Defer defer = [](const auto& make) { make(); });

  /// Refuses what `source` cannot give: bodies that it does not hold, or what a recording lacks. Errors name the field.
  [[nodiscard]] static base::Status check_asked(const v1::Subscribe& request, const FrameSource& source);

  /// Adds the session to the quality class that `request` asks for; a second time changes only its wish for commands
  /// and key frames. Errors name the field.
  [[nodiscard]] base::Result<v1::Subscribed> subscribe(const std::shared_ptr<Session>& session,
                                                       const v1::Subscribe& request, double world_rate_hz);
  /// False where the session has no such stream.
  bool unsubscribe(net::SessionId session, std::uint32_t stream_id, Outbox& outbox);
  void session_ended(net::SessionId session);
  /// The session waits for a key frame of the stream.
  void key_wanted(net::SessionId session, std::uint32_t stream_id);
  /// Ends all streams.
  void close(Outbox& outbox);

  /// The world was edited. Where that added or removed something, new layouts go out, then key frames.
  void edited();

  /// The world's rate was edited: tells each stream's subscribers its new rate, the same whole division as before.
  void rate_changed(const std::string& world, std::uint64_t tick, double world_rate_hz, Outbox& outbox) const;

  /// Frames of the tick just done, for the classes that are due; for all of them where `all` is set. Whoever waits for
  /// a key frame of a class that is not due gets its last frame as a key.
  void encode_tick(const FrameSource& source, std::uint64_t tick, bool all, Outbox& outbox);
  /// Key frames for a world that rests between two ticks: for whoever waits, or for everyone where it was edited.
  void encode_rest(const FrameSource& source, std::uint64_t tick, Outbox& outbox);

  /// A change was carried out after `tick` ticks: tells the subscribers who wish to know.
  void applied(std::uint64_t tick, const v1::ClientMessage& command, Outbox& outbox) const;

  /// Sends a message to every session that has a stream here, once.
  void send_to_all(const v1::ServerMessage& message, Outbox& outbox) const;

  /// The session's streams and how it reads them.
  void describe_streams(net::SessionId session, const net::ReaderStats& reader, double world_rate_hz,
                        v1::Stats& out) const;

  [[nodiscard]] std::size_t subscriber_count() const;
  [[nodiscard]] std::size_t class_count() const { return classes_.size(); }

 private:
  struct Quality {
    std::uint64_t rate_divisor;
    double max_error_m;
    View view;
    bool velocities;
    bool scalars;
    bool time_layers;
    auto operator<=>(const Quality&) const = default;
  };
  struct Subscriber {
    std::shared_ptr<Session> session;
    std::uint32_t layout_id = 0;  // the last one sent; 0: none
    bool wants_key = true;
    bool wants_commands = false;
    double key_interval_s = 0.0;      // 0: none asked for
    std::uint64_t last_key_tick = 0;  // of the last key frame made for it
  };
  struct QualityClass {
    std::uint32_t stream_id;
    LayeredEncoder encoder;
    WorldLayout layout;
    std::map<net::SessionId, Subscriber> subscribers;
    SessionIds sessions;          // of all subscribers; null where they changed
    double encode_time_us = 0.0;  // of the last frame
  };

  [[nodiscard]] std::size_t streams_of(net::SessionId session) const;
  /// Brings the layouts up to date, and tells of each class, in order, what came of it.
  [[nodiscard]] std::vector<WorldLayout::Update> update_layouts(const FrameSource& source);
  void introduce(QualityClass& quality_class, Outbox& outbox);
  [[nodiscard]] static std::vector<net::SessionId> take_due_keys(QualityClass& quality_class,
                                                                 std::uint64_t ticks_between, std::uint64_t tick,
                                                                 double tick_period_s);
  void publish_new(const Quality& quality, QualityClass& quality_class, const FrameSource& source,
                   MeasuredScalars& scalars, std::uint64_t tick, std::uint32_t layer, Outbox& outbox);
  void publish_last(QualityClass& quality_class, Outbox& outbox);

  std::function<std::uint32_t()> take_stream_id_;
  std::function<void(std::uint32_t)> drop_stream_id_;
  MeshTopologies topologies_;
  std::map<Quality, QualityClass> classes_;
};

}  // namespace pneuma::app
