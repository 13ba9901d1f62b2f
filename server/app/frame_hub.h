// A world's subscribers and their frames: encoded once a tick for all subscribers of the same quality.
// Called by the thread that steps the world.
#pragma once

#include <algorithm>
#include <chrono>
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
#include "app/quality_ladder.h"
#include "app/recent_bytes.h"
#include "app/session.h"
#include "app/touch_news.h"
#include "app/world_bytes.h"
#include "base/limits.h"
#include "base/status.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

class FrameHub {
 public:
  /// `take_stream_id` gives an id that no other stream of the server has; `drop_stream_id` hears of the ones that
  /// ended; `defer` makes coarser meshes, by default at once.
  FrameHub(
      std::function<std::uint32_t()> take_stream_id, std::function<void(std::uint32_t)> drop_stream_id,
      MeshTopologies::Defer defer = [](std::size_t /*vertices*/, const auto& make) { make(); });

  /// What the source's own places and velocities may be off by; told in the bounds of every stream. 0 at first.
  void set_source_error(double source_error_m, double source_velocity_error_m_s) {
    source_error_m_ = source_error_m;
    source_velocity_error_m_s_ = source_velocity_error_m_s;
  }

  /// Adds the session to the quality class that `request` asks for; a second time changes only its wishes, for
  /// commands, key frames and adaptive quality. Errors name the field.
  /// `admit` is asked for room in memory where there is no class of that quality yet.
  using Admit = std::function<base::Status(double bytes_per_vertex)>;
  [[nodiscard]] base::Result<v1::Subscribed> subscribe(
      const std::shared_ptr<Session>& session, const v1::Subscribe& request, double world_rate_hz,
      const Admit& admit = [](double) { return base::Status(); });
  /// False where the session has no such stream.
  bool unsubscribe(net::SessionId session, std::uint32_t stream_id, Outbox& outbox);
  void session_ended(net::SessionId session);
  /// The session waits for a key frame of the stream.
  void key_wanted(net::SessionId session, std::uint32_t stream_id);
  /// The session takes no frames of the stream until it waits for a key. What nobody takes is not encoded.
  void stream_stalled(net::SessionId session, std::uint32_t stream_id);
  /// The session asks for one although it could use a delta. False where it has no such stream.
  [[nodiscard]] bool request_key(net::SessionId session, std::uint32_t stream_id);
  /// How an adaptive reader does: where it should have another quality, it is moved by the next encode_tick or
  /// encode_rest, which tells it (STREAM_REPLACED).
  void reader_report(net::SessionId session, const net::ReaderReport& report);
  /// Ends all streams.
  void close(Outbox& outbox);

  /// The world was edited. Where that added or removed something, new layouts go out, then key frames; so they do, in
  /// simulated streams and at most once a second, where bodies have other mechanics.
  void edited();
  /// A body moves otherwise without an edit: the same for its mechanics.
  void mechanics_changed();

  /// The world's rate was edited: each stream gets the rate nearest to what was asked for, and its subscribers are
  /// told.
  void rate_changed(const std::string& world, std::uint64_t tick, double world_rate_hz, Outbox& outbox);

  /// Frames of the tick just done, for the classes that are due; for all of them where `all` is set. Whoever waits for
  /// a key frame of a class that is not due gets its last frame as a key.
  void encode_tick(const FrameSource& source, std::uint64_t tick, bool all, Outbox& outbox);
  /// Key frames for a world that rests between two ticks: for whoever waits, or for everyone where it was edited.
  void encode_rest(const FrameSource& source, std::uint64_t tick, Outbox& outbox);

  /// A change that was carried out after so many ticks.
  struct Change {
    std::uint64_t tick = 0;
    const v1::ClientMessage& command;
    net::SessionId session = 0;  // that asked for it; 0: nobody's
    std::uint64_t grab_id = 0;   // of a grab
  };
  /// Tells the subscribers who wish to know.
  void applied(const Change& change, Outbox& outbox) const;

  /// Sends a message to every session that has a stream here, once.
  void send_to_all(const v1::ServerMessage& message, Outbox& outbox) const;

  /// The session's streams and how it reads them.
  void describe_streams(net::SessionId session, const net::ReaderStats& reader, double world_rate_hz,
                        v1::Stats& out) const;

  /// The world was reset or rewound: nothing touches until it is told anew.
  void forget_touches();
  /// Tells the subscribers who wish to know what touched in the tick just done.
  void tell_touches(const TickTouches& touches, std::uint64_t tick, Outbox& outbox);
  /// Whether a subscriber wishes to know.
  [[nodiscard]] bool wants_touches() const;
  /// Whether a stream tells contacts.
  [[nodiscard]] bool wants_contacts() const;
  [[nodiscard]] std::size_t subscriber_count() const;
  [[nodiscard]] std::size_t class_count() const { return classes_.size(); }
  /// What the encoders of all classes take for a vertex of the world.
  [[nodiscard]] double bytes_per_vertex() const;
  /// Of frames to all their readers, in the last second; one with a delta counts as the delta.
  [[nodiscard]] double frame_bytes_s() const {
    return static_cast<double>(frame_bytes_.sum(std::chrono::steady_clock::now()));
  }

 private:
  // A frame in a day of ticks is the rarest that is told apart.
  static constexpr auto rate_divisor_max = static_cast<std::uint64_t>(86'400.0 * base::rate_hz_max);

  struct Quality {
    double rate_hz;             // as asked for; 0: the world's
    std::uint64_t rate_factor;  // frames are fewer by this, where an adaptive reader was moved
    double max_error_m;
    View view;
    bool velocities;
    bool scalars;
    bool contacts;
    bool time_layers;
    bool simulated;
    bool plain;
    auto operator<=>(const Quality&) const = default;

    /// Ticks from one frame to the next.
    [[nodiscard]] std::uint64_t divisor(double world_rate_hz) const;
    /// The same frames, as long as the world has this rate.
    [[nodiscard]] bool is_like(const Quality& other, double world_rate_hz) const;
    [[nodiscard]] double bytes_per_vertex() const {
      return stream_bytes_per_vertex(velocities, time_layers, view.level);
    }
  };
  struct Adaptive {
    std::string world;
    Quality asked;
    QualityLadder ladder{};
    bool reported_on = false;              // of the stream that it has now
    std::optional<std::size_t> to_rung{};  // where it is to be moved
    bool ends = false;                     // with that move: it asked for a fixed quality again
  };
  struct Subscriber {
    std::shared_ptr<Session> session;
    std::optional<Adaptive> adaptive{};
    std::uint32_t layout_id = 0;  // the last one sent; 0: none
    bool wants_key = true;
    bool is_stalled = false;
    bool takes_no_delta = false;  // the next frame that can be a key is one for it
    bool wants_commands = false;
    std::optional<TouchNews> touches{};
    double key_interval_s = 0.0;      // 0: none asked for
    std::uint64_t last_key_tick = 0;  // of the last key frame made for it
  };
  struct QualityClass {
    std::uint32_t stream_id;
    std::uint64_t rate_divisor;  // ticks from one frame to the next
    LayeredEncoder encoder;
    WorldLayout layout;
    std::map<net::SessionId, Subscriber> subscribers;
    SessionIds sessions;          // of all subscribers; null where they changed
    double encode_time_us = 0.0;  // of the last frame
    bool was_left_out = false;    // since nobody took its frames

    /// How an adaptive reader does shows in what it is offered, so it counts though it stalls.
    [[nodiscard]] bool is_taken() const {
      return std::ranges::any_of(
          subscribers, [](const auto& entry) { return !entry.second.is_stalled || entry.second.adaptive.has_value(); });
    }
  };
  using Classes = std::map<Quality, QualityClass>;

  [[nodiscard]] std::size_t streams_of(net::SessionId session) const;
  /// Those whose readers are all the client's.
  [[nodiscard]] std::size_t classes_of_client(const std::string& client) const;
  /// Null where the session has no such stream.
  [[nodiscard]] Subscriber* find(net::SessionId session, std::uint32_t stream_id);
  [[nodiscard]] static bool leave_out_untaken(QualityClass& quality_class);
  /// Brings the layouts up to date, and tells of each class, in order, what came of it.
  [[nodiscard]] std::vector<WorldLayout::Update> update_layouts(const FrameSource& source, std::uint64_t tick);
  [[nodiscard]] v1::Subscribed describe(const Classes::value_type& entry, const std::string& world,
                                        double world_rate_hz) const;
  [[nodiscard]] Classes::iterator find_asked(net::SessionId session, const Quality& asked, double world_rate_hz);
  [[nodiscard]] Classes::iterator class_of(const Quality& quality, double world_rate_hz);
  void set_wishes(Classes::value_type& entry, net::SessionId session, const v1::Subscribe& request,
                  const Quality& asked);
  [[nodiscard]] std::optional<Quality> on_rung(const Quality& asked, std::size_t rung) const;
  void move_readers(std::uint64_t tick, double world_rate_hz, Outbox& outbox);
  bool move_reader(Classes::iterator from, net::SessionId session, std::size_t rung, std::uint64_t tick,
                   double world_rate_hz, Outbox& outbox);
  Classes::iterator leave(Classes::iterator from, net::SessionId session);
  void introduce(QualityClass& quality_class, Outbox& outbox);
  [[nodiscard]] static std::vector<net::SessionId> take_due_keys(QualityClass& quality_class,
                                                                 std::uint64_t ticks_between, std::uint64_t tick,
                                                                 double tick_period_s);
  void publish_new(const Quality& quality, QualityClass& quality_class, const FrameSource& source,
                   MeasuredScalars& scalars, std::uint64_t tick, std::uint32_t layer, Outbox& outbox);
  void publish(SessionIds sessions, net::StreamFrame frame, Outbox& outbox);
  void publish_last(QualityClass& quality_class, Outbox& outbox);

  std::function<std::uint32_t()> take_stream_id_;
  std::function<void(std::uint32_t)> drop_stream_id_;
  MeshTopologies topologies_;
  Classes classes_;
  RecentBytes frame_bytes_;
  double source_error_m_ = 0.0;
  double source_velocity_error_m_s_ = 0.0;
};

}  // namespace pneuma::app
