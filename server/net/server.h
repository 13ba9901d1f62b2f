// Listens on TCP (length-prefixed messages) and HTTP (/ws: one message a WebSocket message; anything else is asked of
// its owner), and moves opaque messages between sessions and their owner. One network thread runs it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/limits.h"
#include "base/memory_budget.h"
#include "base/status.h"
#include "net/reader_stats.h"

namespace pneuma::net {

using SessionId = std::uint64_t;
using SharedBytes = std::shared_ptr<const std::string>;

struct PeerInfo {
  std::string address;     // HOST:PORT
  std::string counted_as;  // the name under which what the address takes is counted
  bool websocket = false;
  bool tls = false;
};

inline constexpr std::uint32_t time_layer_max = 2;

/// A message as it came; its bytes are counted as the server's until it goes.
struct ReceivedMessage {
  std::string bytes;
  base::MemoryBudget::Share share;
};

/// One frame of a stream, offered in both forms; a session takes the one that it can use.
struct StreamFrame {
  std::uint32_t stream_id = 0;
  std::uint64_t tick = 0;
  std::uint64_t base_tick = 0;  // what `delta` builds on: of a lower layer, or both of layer 0
  std::uint32_t layer = 0;      // at most time_layer_max
  SharedBytes delta;            // null: only a key frame this time
  SharedBytes key;              // null: nobody was known to want one
  std::size_t vertices = 0;     // that it shows
};

struct HttpReply {
  int status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  SharedBytes body;  // null: empty
  // Of a file:
  SharedBytes gzip_body;  // the same compressed; null: there is none
  std::string tag;        // a strong entity tag, with its quotes, of a body that may be kept; empty: it may not
};
/// A GET of anything but /ws.
struct PageRequest {
  std::string_view path;
  std::string_view authorization;  // the header; empty: none
  std::string_view counted_as;     // whose it is: PeerInfo::counted_as
};
/// One that is not kept.
[[nodiscard]] HttpReply text_reply(int status, std::string text,
                                   std::string content_type = "text/plain; charset=utf-8");

/// What all sessions hold in memory together, in bytes.
struct MemoryStats {
  std::size_t received = 0;  // of messages that are not whole, or not dealt with
  std::size_t queued = 0;    // of messages that are not sent; one that is queued for several sessions counts once
};

/// How a session stands; for stats and metrics.
struct SessionStats {
  std::size_t queue_bytes = 0;
  FrameTotals frames;
  QueueAges queue_ages;
  std::uint64_t bytes_sent = 0;
  std::uint64_t bytes_received = 0;
};

/// What the server's owner is told and asked. All calls come on the network thread and return at once.
struct Callbacks {
  std::function<void(SessionId, const PeerInfo&)> opened;
  /// One whole message. After it the owner may hold() the session.
  std::function<void(SessionId, ReceivedMessage)> received;
  std::function<void(SessionId, const base::Status& why)> closed;
  /// A connection was past a limit of connections; may be left out.
  std::function<void()> refused;
  /// The session cannot use this stream's deltas any more and waits for a key frame.
  std::function<void(SessionId, std::uint32_t stream_id)> key_wanted;
  /// The session takes no frames of the stream for now, keys neither, until it wants a key. May be left out.
  std::function<void(SessionId, std::uint32_t stream_id)> stream_stalled;
  /// How a stream is read of which reports were asked for: while frames of it come, a few times a second.
  std::function<void(SessionId, const ReaderReport&)> reader_report;
  std::function<HttpReply(const PageRequest&)> http;
  /// The same where the server is full: nothing, but for what must be answered then too.
  std::function<std::optional<HttpReply>(const PageRequest&)> http_when_full;

  // Messages of the owner's protocol that the session logic needs to send by itself.
  std::function<std::string(std::uint64_t nonce)> make_ping;
  std::function<std::string(const base::Status& why)> make_goodbye;
  std::function<std::string(std::uint32_t stream_id, std::uint64_t from_tick, std::uint64_t to_tick)> make_gap;
};

struct Tls {
  std::string certificate_file;  // PEM chain
  std::string key_file;
};

/// Whether HOST:PORT is reached from this machine alone, whatever addresses the name has.
[[nodiscard]] base::Result<bool> reaches_this_machine_alone(const std::string& address);

class Server {
 public:
  /// `host_names`: what requests over HTTP may call this server beside its addresses and localhost.
  Server(const base::Limits& limits, Callbacks callbacks, std::vector<std::string> host_names = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// `address` is HOST:PORT or [V6]:PORT; port 0 picks a free one. Errors name the address and the cause.
  [[nodiscard]] base::Status listen_tcp(const std::string& address, const std::optional<Tls>& tls);
  [[nodiscard]] base::Status listen_http(const std::string& address, const std::optional<Tls>& tls);
  /// Takes certificate and key for the connections to come, from the next one on; those that are open keep theirs.
  /// Where they cannot be used, nothing changes. Any thread.
  [[nodiscard]] base::Status reload_tls(const Tls& tls);
  /// HOST:PORT as bound; empty where not listening.
  [[nodiscard]] std::string tcp_address() const;
  [[nodiscard]] std::string http_address() const;

  /// Serves until stop() has drained.
  void run();

  // From here on: callable from any thread, ordered among calls of one thread.

  /// Queues a reply or event; never dropped.
  void send(SessionId session, SharedBytes message);
  /// Offers a frame to each of `sessions`; those too slow skip it (output_queue.h).
  void publish(std::shared_ptr<const std::vector<SessionId>> sessions, StreamFrame frame);
  /// The client has said who it is: full-size messages are taken and the hello time-out ends.
  void authenticated(SessionId session);
  /// The client answered the ping with this nonce.
  void pong(SessionId session, std::uint64_t nonce);
  /// Asks for reports on how the session reads the stream, until the stream ends.
  void report_on(SessionId session, std::uint32_t stream_id);
  /// Reads no further message of the session until resume(): the owner is busy with the last one. On the network
  /// thread, from received().
  void hold(SessionId session);
  void resume(SessionId session);
  /// Reads no further message of the session for so long: what it sends meanwhile waits in its own socket. On the
  /// network thread, from received().
  void pause_reading(SessionId session, std::chrono::milliseconds pause);
  /// Calls `work` on the network thread.
  void post(std::function<void()> work);
  /// Forgets the stream's place in the session's queue and drops its unsent frames.
  void end_stream(SessionId session, std::uint32_t stream_id);
  /// Sends a goodbye with the reason after what is queued, then closes.
  void close(SessionId session, base::Status why);
  /// Stops accepting, says goodbye to all, gives the queues drain_timeout to empty; run() then returns.
  void stop(base::Status why);

  [[nodiscard]] MemoryStats memory() const;

  /// Network thread only.
  [[nodiscard]] std::optional<SessionStats> stats(SessionId session) const;
  [[nodiscard]] ReaderStats reader_stats(SessionId session) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pneuma::net
