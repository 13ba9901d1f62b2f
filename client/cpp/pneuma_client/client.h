// A connection to a pneuma-server: requests that wait for their reply, and the frames and events that come in between.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/status.h"
#include "pneuma/v1/scene.pb.h"
#include "pneuma/v1/session.pb.h"
#include "pneuma_client/frames.h"

namespace pneuma::client {

struct ConnectOptions {
  std::string token;
  std::string client_name = "pneuma-client";
  bool tls = false;
  std::string ca_file;                               // PEM; empty: the system's certificates
  std::chrono::milliseconds connect_timeout{5'000};  // to resolve, connect and be welcomed
  std::chrono::milliseconds reply_timeout{10'000};
  std::vector<TopologyPtr> topologies;  // held from an earlier connection
};

struct SubscribeOptions {
  double rate_hz = 0.0;      // 0: the world's
  double max_error_m = 0.0;  // 0: the server's default
  bool commands = false;     // tell of each change of the world (v1::Applied)
  double key_interval_s = 0.0;
  std::vector<std::string> bodies = {};  // the soft bodies of these names; none: all
  std::uint32_t level_of_detail = 0;     // each level has a quarter of the vertices of the one below
  bool velocities = false;
  bool scalars = false;
  bool contacts = false;
  bool time_layers = false;  // read too slowly, the stream has fewer frames instead of gaps and keys
  // The server may move the reader to coarser qualities and back: its frames then keep the id that subscribe() gave,
  // and each move is an Event STREAM_REPLACED.
  bool adaptive = false;
  bool simulated = false;  // fewer bits, by simulating the bodies here, too: 0.1 to 0.3 us a vertex a frame
};

/// A frame of a stream left vertices that are not the server's. The client has asked for a key frame; frames before
/// that one do not come.
struct StreamFault {
  std::uint32_t stream_id = 0;
  std::uint64_t tick = 0;
  base::Status status;  // what is wrong
};

/// What comes unasked, in the order of its arrival.
using Update = std::variant<DecodedFrame, v1::Gap, v1::Event, v1::Applied, StreamFault>;

/// Not thread-safe; every call is bounded in time. A server's ping is answered while a call waits, so a client that
/// makes no call for longer than the server's ping limit (WIRE.md) is closed by it. An error reply leaves the
/// connection usable; a broken connection, a goodbye and bytes that cannot be understood end it: every later call gives
/// that same status again.
class Client {
 public:
  /// `address` is HOST:PORT or [V6]:PORT. Connects, says hello and waits for the welcome. Errors name the address.
  [[nodiscard]] static base::Result<Client> connect(const std::string& address, const ConnectOptions& options = {});
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  [[nodiscard]] const v1::Welcome& welcome() const;

  // Requests. An error reply becomes a status with its code, what and where.

  /// Sends any request (its id is set here) and waits for its reply. `timeout` 0: reply_timeout.
  [[nodiscard]] base::Result<v1::ServerMessage> call(v1::ClientMessage request, std::chrono::milliseconds timeout = {});

  [[nodiscard]] base::Result<v1::WorldList> list_worlds();
  [[nodiscard]] base::Result<v1::Done> create_world(const v1::CreateWorld& request);
  /// A built-in scene by its name; `world` empty: named by the scene.
  [[nodiscard]] base::Result<v1::Done> create_builtin(const std::string& scene, const std::string& world = {},
                                                      bool paused = false);
  [[nodiscard]] base::Result<v1::Done> destroy_world(const std::string& world);

  /// The topologies held are named in the request; the reply's stream_id names the frames.
  [[nodiscard]] base::Result<v1::Subscribed> subscribe(const std::string& world, const SubscribeOptions& options = {});
  [[nodiscard]] base::Result<v1::Done> unsubscribe(std::uint32_t stream_id);

  [[nodiscard]] base::Result<v1::Done> edit(const std::string& world, const v1::SceneEdit& edit);
  [[nodiscard]] base::Result<v1::Done> edit_json(const std::string& world, const std::string& edit_json);
  [[nodiscard]] base::Result<v1::Done> impulse(const v1::Impulse& request);
  [[nodiscard]] base::Result<v1::Grabbed> grab(const v1::Grab& request);
  [[nodiscard]] base::Result<v1::Done> move_grab(const std::string& world, std::uint64_t grab_id,
                                                 const v1::Vec3& target);
  [[nodiscard]] base::Result<v1::Done> release_grab(const std::string& world, std::uint64_t grab_id);

  [[nodiscard]] base::Result<v1::Done> pause(const std::string& world);
  /// `time_scale`: simulated over real time from now on, also of a world that runs; otherwise as it was.
  [[nodiscard]] base::Result<v1::Done> resume(const std::string& world, std::optional<double> time_scale = {});
  /// Waits for the last of the ticks.
  [[nodiscard]] base::Result<v1::Done> step(const std::string& world, std::uint32_t ticks,
                                            std::chrono::milliseconds timeout = std::chrono::minutes(10));
  [[nodiscard]] base::Result<v1::Done> reset(const std::string& world);
  /// Of a recording that is played: `time_s` counts from its first frame.
  [[nodiscard]] base::Result<v1::Done> seek(const std::string& world, double time_s);
  /// A world file (WIRE.md) of the world as it is, in `data`; the rest tells of it.
  [[nodiscard]] base::Result<v1::Snapshot> snapshot(const std::string& world);
  // These wait as long as step(): a world may be replayed for them.
  [[nodiscard]] base::Result<v1::Done> restore_world(const v1::RestoreWorld& request);
  [[nodiscard]] base::Result<v1::Done> branch_world(const v1::BranchWorld& request);
  [[nodiscard]] base::Result<v1::Done> rewind_world(const std::string& world, std::uint64_t tick);
  [[nodiscard]] base::Result<v1::Stats> stats(const std::string& world);
  [[nodiscard]] base::Result<v1::SceneReply> scene(const std::string& world);
  /// The round trip.
  [[nodiscard]] base::Result<std::chrono::nanoseconds> ping();

  // What comes unasked. It is kept, in order, while a request waits; past updates_max the oldest goes.

  /// The next of all; nothing when `timeout` passes first.
  [[nodiscard]] base::Result<std::optional<Update>> next_update(std::chrono::milliseconds timeout);
  /// The next frame, or event; what is passed over stays.
  [[nodiscard]] base::Result<std::optional<DecodedFrame>> next_frame(std::chrono::milliseconds timeout);
  [[nodiscard]] base::Result<std::optional<v1::Event>> next_event(std::chrono::milliseconds timeout);

  /// Called with each message of a stream (topology, layout, frame, gap, event, applied) once it has been understood,
  /// as it was received, before it becomes an update. For recording.
  using Tap = std::function<void(std::string_view bytes, const v1::ServerMessage& message)>;
  void set_tap(Tap tap);

  static constexpr std::size_t updates_max = 1'024;
  /// Updates that were dropped because nobody took them.
  [[nodiscard]] std::uint64_t updates_dropped() const;
  /// Gaps announced by the server, all streams together, and the ticks that they span.
  [[nodiscard]] std::uint64_t gaps() const;
  [[nodiscard]] std::uint64_t ticks_missed() const;

  /// For a later connection's options.
  [[nodiscard]] std::vector<TopologyPtr> topologies() const;

 private:
  struct Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// What an error reply says.
[[nodiscard]] base::Status to_status(const v1::Error& error);

/// The largest request that the server takes, in parts (which a Client cuts it into) or at once.
[[nodiscard]] std::size_t request_bytes_max(const v1::Welcome& welcome);

/// Splits HOST:PORT or [V6]:PORT. False where it is neither.
[[nodiscard]] bool split_address(std::string_view address, std::string& host, std::string& port);

}  // namespace pneuma::client
