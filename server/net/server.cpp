#include "net/server.h"

#include <algorithm>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "net/admission.h"
#include "net/handshake_pace.h"
#include "net/http_front.h"
#include "net/listening.h"
#include "net/output_queue.h"
#include "net/session.h"
#include "net/spare_descriptors.h"

namespace pneuma::net {

namespace {

using boost::system::error_code;
using Tcp = asio::ip::tcp;

// Out of file descriptors: the clients we have come first, then we look again.
constexpr std::chrono::milliseconds accept_pause{100};

base::Status out_of_descriptors() {
  return {base::StatusCode::unavailable, "the server has no file descriptors left; try again later"};
}

}  // namespace

struct Server::Impl {
  using PlacePtr = std::shared_ptr<const Admission::Place>;
  enum class Kind { tcp, http };

  struct Listener {
    Tcp::acceptor acceptor;
    Kind kind;
    std::shared_ptr<asio::ssl::context> tls;
    std::string address;  // as bound
  };

  Impl(const base::Limits& l, Callbacks c, std::vector<std::string> host_names)
      : limits(l),
        hosts(std::move(host_names)),
        callbacks(std::move(c)),
        admission(l),
        received_memory(l.received_bytes_max),
        queued_memory(l.queued_bytes_max) {}

  base::Status listen(const std::string& address, const std::optional<Tls>& tls, Kind kind);
  asio::awaitable<void> accept_connections(Listener& listener);
  void take(Tcp::socket socket, const Listener& listener, base::Status refusal);
  asio::awaitable<void> begin(Tcp::socket socket, const Listener& listener, PeerInfo peer, PlacePtr place,
                              std::chrono::steady_clock::duration wait);
  asio::awaitable<void> serve_page(Tcp::socket socket, std::shared_ptr<asio::ssl::context> tls, PeerInfo peer,
                                   PlacePtr place);
  void open_session(std::unique_ptr<Transport> transport, PeerInfo peer, PlacePtr place);
  void end_session(SessionId id);
  void stop(const base::Status& why);
  [[nodiscard]] SharedBytes count(SharedBytes message) const;
  /// What is left past it is for replies.
  [[nodiscard]] bool frames_have_room() const {
    return queued_memory.bytes() < queued_memory.bytes_max() - queued_memory.bytes_max() / 8;
  }
  void make_room();
  [[nodiscard]] std::string bound_address(Kind kind) const;

  template <class Work>
  void with_session(SessionId id, const Work& work) {
    if (const auto found = sessions.find(id); found != sessions.end()) work(*found->second);
  }
  template <class Work>
  void post_to_session(SessionId id, Work work) {
    asio::post(io, [this, id, work = std::move(work)] { with_session(id, work); });
  }

  base::Limits limits;
  const AllowedHosts hosts;
  Callbacks callbacks;
  Clock clock;
  Admission admission;
  HandshakePace handshakes;
  SpareDescriptors spares;
  const base::MemoryBudget received_memory;
  const base::MemoryBudget queued_memory;
  SessionId next_id = 1;
  bool stopping = false;
  base::Status stop_reason;

  asio::io_context io{1};
  asio::executor_work_guard<asio::io_context::executor_type> work{io.get_executor()};
  asio::steady_timer drain_timer{io};
  std::vector<std::unique_ptr<Listener>> listeners;
  std::unordered_map<SessionId, std::shared_ptr<Session>> sessions;
};

base::Status Server::Impl::listen(const std::string& address, const std::optional<Tls>& tls, Kind kind) {
  std::shared_ptr<asio::ssl::context> context;
  if (tls) {
    auto loaded = load_tls(*tls);
    if (!loaded.ok()) return loaded.status();
    context = *loaded;
  }
  auto acceptor = listen_at(io, address);
  if (!acceptor.ok()) return acceptor.status();
  error_code ignored;
  const std::string bound = to_text(acceptor->local_endpoint(ignored));
  listeners.push_back(std::make_unique<Listener>(Listener{std::move(*acceptor), kind, std::move(context), bound}));
  asio::co_spawn(io, accept_connections(*listeners.back()), asio::detached);
  return {};
}

asio::awaitable<void> Server::Impl::accept_connections(Listener& listener) {
  asio::steady_timer pause(io);
  bool by_spare = false;  // the last descriptors are for who is told that there are none, and for health checks
  while (!stopping) {
    if (!by_spare) spares.fill();
    error_code error;
    Tcp::socket socket = co_await listener.acceptor.async_accept(asio::redirect_error(asio::use_awaitable, error));
    if (stopping) co_return;
    if (!error) {
      const bool is_short = std::exchange(by_spare, false) && !spares.fill();
      take(std::move(socket), listener, is_short ? out_of_descriptors() : base::Status());
      continue;
    }
    by_spare = error == asio::error::no_descriptors && spares.give_up_one();
    if (by_spare) continue;
    pause.expires_after(accept_pause);
    co_await pause.async_wait(asio::redirect_error(asio::use_awaitable, error));
  }
}

void Server::Impl::take(Tcp::socket socket, const Listener& listener, base::Status refusal) {
  error_code error;
  const Tcp::endpoint peer = socket.remote_endpoint(error);
  if (error) return;
  std::string counted = counted_as(peer.address());
  PlacePtr place = admission.admit(counted, std::move(refusal));
  if ((place == nullptr || place->refused()) && callbacks.refused) callbacks.refused();
  if (place == nullptr) return;
  tune(socket);
  PeerInfo info{to_text(peer), std::move(counted), listener.kind == Kind::http, listener.tls != nullptr};
  const auto wait = info.tls ? handshakes.wait(info.counted_as, std::chrono::steady_clock::now())
                             : std::chrono::steady_clock::duration{};
  asio::co_spawn(io, begin(std::move(socket), listener, std::move(info), std::move(place), wait), asio::detached);
}

asio::awaitable<void> Server::Impl::begin(Tcp::socket socket, const Listener& listener, PeerInfo peer, PlacePtr place,
                                          std::chrono::steady_clock::duration wait) {
  if (wait > std::chrono::steady_clock::duration::zero()) {
    error_code ignored;
    asio::steady_timer until(io, wait);
    co_await until.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    if (stopping) co_return;
  }
  if (listener.kind == Kind::http) {
    co_await serve_page(std::move(socket), listener.tls, std::move(peer), std::move(place));
  } else {
    open_session(make_stream_transport(std::move(socket), listener.tls.get(), base::message_bytes_max_before_hello,
                                       received_memory),
                 std::move(peer), std::move(place));
  }
}

asio::awaitable<void> Server::Impl::serve_page(Tcp::socket socket, std::shared_ptr<asio::ssl::context> tls,
                                               PeerInfo peer, PlacePtr place) {
  HttpFront front{callbacks.http, {}, limits.partial_message_timeout, received_memory, hosts, peer.counted_as};
  if (place->refused())
    front.reply = [this, why = place->refusal().what()](const PageRequest& request) {
      if (callbacks.http_when_full) {
        if (std::optional<HttpReply> reply = callbacks.http_when_full(request)) return std::move(*reply);
      }
      return text_reply(503, why + "\n");
    };
  if (!place->refused()) {
    front.upgraded = [this, &peer, &place](std::unique_ptr<Transport> transport) {
      open_session(std::move(transport), std::move(peer), std::move(place));
    };
  }
  co_await serve_http(std::move(socket), tls.get(), front);
}

// The session holds its place, and gives it back when it goes.
void Server::Impl::open_session(std::unique_ptr<Transport> transport, PeerInfo peer, PlacePtr place) {
  const SessionId id = next_id++;
  const base::Status refusal = place->refusal();
  auto session =
      std::make_shared<Session>(id, std::move(peer), std::move(transport), limits, callbacks, clock, io.get_executor(),
                                [this, place = std::move(place)](SessionId ended) { end_session(ended); });
  if (!refusal.ok()) return session->refuse(refusal);
  if (stopping) return session->refuse(stop_reason);
  sessions.emplace(id, session);
  session->start();
}

void Server::Impl::end_session(SessionId id) {
  if (sessions.erase(id) > 0 && stopping && sessions.empty()) io.stop();
}

/// The message, counted for as long as anyone holds it.
SharedBytes Server::Impl::count(SharedBytes message) const {
  if (message == nullptr) return nullptr;
  struct Counted {
    SharedBytes message;
    base::MemoryBudget::Share share;
  };
  const std::string* bytes = message.get();
  auto share = queued_memory.take_anyway(bytes->size() + queued_message_overhead_bytes);
  return {std::make_shared<const Counted>(Counted{std::move(message), std::move(share)}), bytes};
}

// Replies keep all frames waiting, or will soon fill what is left: of whoever has most of them waiting, the longest
// queue goes. Where nobody has many, it is frames that wait, and they give way by themselves.
void Server::Impl::make_room() {
  if (frames_have_room()) return;
  std::unordered_map<std::string_view, std::size_t> replies_of;
  for (const auto& [id, session] : sessions) {
    if (!session->closing()) replies_of[session->client()] += session->unread_reply_bytes();
  }
  const auto most = std::ranges::max_element(replies_of, {}, [](const auto& of) { return of.second; });
  std::size_t replies = 0;
  for (const auto& [client, bytes] : replies_of) replies += bytes;
  const std::size_t room = queued_memory.bytes_max();
  const bool many_wait = queued_memory.bytes() >= room || replies >= room / 2;
  if (replies == 0 || (!many_wait && most->second < room / 8)) return;
  const auto longest = std::ranges::max_element(sessions, {}, [&](const auto& of) {
    return of.second->closing() || of.second->client() != most->first ? 0 : of.second->unread_reply_bytes();
  });
  const std::shared_ptr<Session> session = longest->second;
  session->close({base::StatusCode::unavailable, "the server has no room for the replies that wait for you"});
  session->abort();
}

void Server::Impl::stop(const base::Status& why) {
  if (std::exchange(stopping, true)) return;
  stop_reason = why;
  error_code ignored;
  for (auto& listener : listeners) listener->acceptor.close(ignored);
  if (sessions.empty()) return io.stop();
  const auto open = sessions;  // closing may end some at once
  for (const auto& [id, session] : open) session->close(why);
  drain_timer.expires_after(limits.drain_timeout);
  drain_timer.async_wait([this](const error_code&) { io.stop(); });
}

std::string Server::Impl::bound_address(Kind kind) const {
  for (const auto& listener : listeners) {
    if (listener->kind == kind) return listener->address;
  }
  return {};
}

HttpReply text_reply(int status, std::string text, std::string content_type) {
  return {status, std::move(content_type), std::make_shared<const std::string>(std::move(text)), {}, {}};
}

Server::Server(const base::Limits& limits, Callbacks callbacks, std::vector<std::string> host_names)
    : impl_(std::make_unique<Impl>(limits, std::move(callbacks), std::move(host_names))) {}
Server::~Server() = default;

base::Status Server::listen_tcp(const std::string& address, const std::optional<Tls>& tls) {
  return impl_->listen(address, tls, Impl::Kind::tcp);
}
base::Status Server::listen_http(const std::string& address, const std::optional<Tls>& tls) {
  return impl_->listen(address, tls, Impl::Kind::http);
}
base::Status Server::reload_tls(const Tls& tls) {
  auto loaded = load_tls(tls);
  if (!loaded.ok()) return loaded.status();
  asio::post(impl_->io, [impl = impl_.get(), context = std::move(*loaded)] {
    for (auto& listener : impl->listeners) {
      if (listener->tls != nullptr) listener->tls = context;
    }
  });
  return {};
}
std::string Server::tcp_address() const {
  return impl_->bound_address(Impl::Kind::tcp);
}
std::string Server::http_address() const {
  return impl_->bound_address(Impl::Kind::http);
}

void Server::run() {
  impl_->io.run();
}

void Server::send(SessionId session, SharedBytes message) {
  asio::post(impl_->io, [impl = impl_.get(), session, message = std::move(message)] {
    impl->with_session(session, [&](Session& s) {
      s.send(impl->count(message));
      impl->make_room();
    });
  });
}

void Server::publish(std::shared_ptr<const std::vector<SessionId>> sessions, StreamFrame frame) {
  asio::post(impl_->io, [impl = impl_.get(), sessions = std::move(sessions), frame = std::move(frame)]() mutable {
    frame.delta = impl->count(std::move(frame.delta));
    frame.key = impl->count(std::move(frame.key));
    const bool full = !impl->frames_have_room();
    for (const SessionId id : *sessions) {
      impl->with_session(id, [&](Session& s) { s.offer(frame, full); });
    }
  });
}

// Done at once on the network thread: the client's next message may be in the same buffer as its hello, and past the
// limit before it.
void Server::authenticated(SessionId session) {
  asio::dispatch(impl_->io,
                 [impl = impl_.get(), session] { impl->with_session(session, [](Session& s) { s.authenticated(); }); });
}

void Server::pong(SessionId session, std::uint64_t nonce) {
  impl_->post_to_session(session, [nonce](Session& s) { s.pong(nonce); });
}

void Server::report_on(SessionId session, std::uint32_t stream_id) {
  impl_->post_to_session(session, [stream_id](Session& s) { s.report_on(stream_id); });
}

void Server::hold(SessionId session) {
  impl_->with_session(session, [](Session& s) { s.hold(); });
}

void Server::pause_reading(SessionId session, std::chrono::milliseconds pause) {
  impl_->with_session(session, [pause](Session& s) { s.pause_reading(pause); });
}

void Server::resume(SessionId session) {
  impl_->post_to_session(session, [](Session& s) { s.resume(); });
}

void Server::post(std::function<void()> work) {
  asio::post(impl_->io, std::move(work));
}

void Server::end_stream(SessionId session, std::uint32_t stream_id) {
  impl_->post_to_session(session, [stream_id](Session& s) { s.end_stream(stream_id); });
}
// What was received together with the message that ends the session is not looked at any more; the rest waits for its
// turn, so that closed() is never called out of received().
void Server::close(SessionId session, base::Status why) {
  asio::dispatch(impl_->io, [impl = impl_.get(), session, why = std::move(why)] {
    impl->with_session(session, [](Session& s) { s.stop_reading(); });
    impl->post_to_session(session, [why](Session& s) { s.close(why); });
  });
}

void Server::stop(base::Status why) {
  asio::post(impl_->io, [impl = impl_.get(), why = std::move(why)] { impl->stop(why); });
}

MemoryStats Server::memory() const {
  return {impl_->received_memory.bytes(), impl_->queued_memory.bytes()};
}

std::optional<SessionStats> Server::stats(SessionId session) const {
  const auto found = impl_->sessions.find(session);
  if (found == impl_->sessions.end()) return std::nullopt;
  return found->second->stats();
}

ReaderStats Server::reader_stats(SessionId session) const {
  const auto found = impl_->sessions.find(session);
  return found == impl_->sessions.end() ? ReaderStats() : found->second->reader_stats();
}

}  // namespace pneuma::net
