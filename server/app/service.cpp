#include "app/service.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include <spdlog/spdlog.h>

#include "app/auth.h"
#include "app/http_pages.h"
#include "app/log.h"
#include "app/protocol.h"
#include "app/request_kinds.h"
#include "base/address.h"
#include "base/token_limits.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;
using std::chrono::steady_clock;

namespace {

// Of the memory that requests may take together, the part that those of one client may: a largest message, by default.
constexpr std::size_t client_requests_share = 4;

/// After each message past its rate a connection is not read for so long: it is refused 50 times a second at most.
constexpr std::chrono::milliseconds over_rate_pause{20};

/// Those that were named, and the one that the server listens at.
std::vector<std::string> host_names(const Config& config) {
  std::vector<std::string> names = config.allow_hosts;
  if (const auto address = base::parse_address(config.http); address.ok()) names.push_back(address->host);
  return names;
}

/// Of --token-file or the environment; anybody may have thought of it.
std::optional<Token> own_token(const std::string& secret) {
  if (secret.empty()) return std::nullopt;
  const bool is_guessable = secret.size() < base::token_unguessable_characters;
  return Token{{"token-file", Role::admin, {}, {}}, digest_of(secret), is_guessable};
}

/// The addresses of the config that are reached from elsewhere, by their flags.
base::Result<std::string> flags_open_to_others(const Config& config) {
  std::string flags;
  for (const auto& [flag, address] : {std::pair("--listen ", config.listen), std::pair("--http ", config.http)}) {
    if (address == "off") continue;
    const auto is_own = net::reaches_this_machine_alone(address);
    if (!is_own.ok()) return is_own.status();
    if (!*is_own) flags.append(flags.empty() ? "" : ", ").append(flag).append(address);
  }
  return flags;
}

}  // namespace

Service::Service(Config config, const MakeHost& make_host)
    : config_(std::move(config)),
      requests_memory_(config_.limits.requests_memory_bytes_max),
      server_(config_.limits, callbacks(), host_names(config_)),
      host_(make_host(config_, server_, metrics_)),
      gatekeeper_(config_.limits),
      parts_(config_.limits) {}

Service::~Service() {
  (void)stop();
}

Status Service::start() {
  auto tokens = read_all_tokens();
  if (!tokens.ok()) return tokens.status();
  if (*tokens) gatekeeper_.use(std::move(**tokens));
  if (auto status = check_openness(); !status.ok()) return status;
  if (config_.http != "off" && config_.web_dir != "off") {
    auto web = WebFolder::load(config_.web_dir);
    if (!web.ok()) {
      return {web.status().code(), web.status().what(), "--web-dir " + web.status().where()};
    }
    web_ = std::move(*web);
  }
  // Protobuf makes what it knows of messages where that is first asked for: here, before there are threads. The thread
  // sanitizer does not see that it guards it.
  (void)v1::ClientMessage::descriptor();
  (void)v1::Scene::descriptor();
  if (auto status = host_->start(); !status.ok()) return status;
  if (auto status = listen(); !status.ok()) return status;
  network_ = std::thread([this] { server_.run(); });
  return {};
}

// Before anything is done: who starts it is there to read why it does not serve.
Status Service::check_openness() const {
  const auto open = flags_open_to_others(config_);
  if (!open.ok()) return open.status();
  if (open->empty()) return {};
  if (gatekeeper_.asks_for_tokens()) {
    if (config_.tls_certificate.empty()) spdlog::warn("{} without TLS: tokens can be read on their way", *open);
    return {};
  }
  if (config_.insecure) {
    spdlog::warn("{} without a token: whoever reaches it may do everything", *open);
    return {};
  }
  return {StatusCode::failed_precondition,
          "others than this machine reach it, and it asks for no token. Give it tokens (--tokens or --token-file FILE, "
          "or PNEUMA_TOKEN), or say --insecure to let everyone do everything",
          *open};
}

base::Result<std::optional<std::vector<Token>>> Service::read_all_tokens() {
  std::string secret = config_.token;
  if (!config_.token_file.empty()) {
    auto token = read_token(config_.token_file);
    if (!token.ok()) return token.status();
    secret = std::move(*token);
    if (is_world_readable(config_.token_file)) spdlog::warn("{} is readable by everyone", config_.token_file);
  }
  own_token_ = own_token(secret);
  std::vector<Token> tokens;
  if (!config_.tokens.empty()) {
    token_file_.emplace(config_.tokens);
    auto read = token_file_->read();
    if (!read.ok()) return read.status();
    tokens = std::move(*read);
    spdlog::info("tokens={} of {}", tokens.size(), log_name(config_.tokens));
  }
  if (own_token_) tokens.push_back(*own_token_);
  if (!own_token_ && !token_file_) return std::optional<std::vector<Token>>();
  return std::optional(std::move(tokens));
}

void Service::tend() {
  if (token_file_ && token_file_->has_changed()) return read_tokens_again();
  server_.post([this] { end_stale_sessions(); });
}

void Service::reload() {
  if (token_file_) read_tokens_again();
  if (config_.tls_certificate.empty()) return;
  if (Status failed = server_.reload_tls({config_.tls_certificate, config_.tls_key}); !failed.ok()) {
    spdlog::error("{}; the certificate of before stays", failed.message());
  } else {
    spdlog::info("certificate={} read again", log_name(config_.tls_certificate));
  }
}

void Service::read_tokens_again() {
  auto tokens = token_file_->read();
  if (!tokens.ok()) {
    spdlog::error("{}; the tokens of before stay", tokens.status().message());
    return;
  }
  if (own_token_) tokens->push_back(*own_token_);
  server_.post([this, tokens = std::move(*tokens)]() mutable {
    const std::size_t count = tokens.size();
    gatekeeper_.use(std::move(tokens));
    end_stale_sessions();
    spdlog::info("tokens={} of {} read again", count, log_name(config_.tokens));
  });
}

void Service::end_stale_sessions() {
  const auto now = wall_clock_now();
  for (const auto& [id, guest] : guests_) {
    if (guest.gate.grant() == nullptr) continue;
    if (Status stale = gatekeeper_.check_still(guest.gate.grant(), now); !stale.ok()) server_.close(id, stale);
  }
}

Status Service::listen() {
  std::optional<net::Tls> tls;
  if (!config_.tls_certificate.empty()) tls = net::Tls{config_.tls_certificate, config_.tls_key};
  if (auto status = server_.listen_tcp(config_.listen, tls); !status.ok()) return status;
  if (config_.http != "off") {
    if (auto status = server_.listen_http(config_.http, tls); !status.ok()) return status;
  }
  return {};
}

std::string Service::tcp_address() const {
  return server_.tcp_address();
}

std::string Service::http_address() const {
  return config_.http == "off" ? "off" : server_.http_address();
}

Status Service::stop() {
  reader_.finish();  // what was received goes to the host, which answers it
  host_->close();    // its last replies go before the goodbyes
  if (network_.joinable()) server_.stop({StatusCode::unavailable, "the server shuts down"});
  Status kept = host_->stop();
  if (network_.joinable()) network_.join();
  return kept;
}

net::Callbacks Service::callbacks() {
  net::Callbacks callbacks;
  callbacks.opened = [this](net::SessionId id, const net::PeerInfo& peer) { opened(id, peer); };
  callbacks.received = [this](net::SessionId id, net::ReceivedMessage message) { received(id, std::move(message)); };
  callbacks.closed = [this](net::SessionId id, const Status& why) { closed(id, why); };
  callbacks.key_wanted = [this](net::SessionId id, std::uint32_t stream_id) { host_->key_wanted(id, stream_id); };
  callbacks.stream_stalled = [this](net::SessionId id, std::uint32_t stream_id) {
    host_->stream_stalled(id, stream_id);
  };
  callbacks.reader_report = [this](net::SessionId id, const net::ReaderReport& report) {
    host_->reader_report(id, report);
  };
  callbacks.refused = [this] { metrics_.connections_refused.Increment(); };
  callbacks.http = [this](const net::PageRequest& asked) { return page(asked); };
  callbacks.http_when_full = [this](const net::PageRequest& asked) -> std::optional<net::HttpReply> {
    const bool is_of_health = asked.path == "/healthz" || asked.path == "/livez" || asked.path == "/readyz";
    return is_of_health ? std::optional(page(asked)) : std::nullopt;
  };
  callbacks.make_ping = make_ping;
  callbacks.make_goodbye = make_goodbye;
  callbacks.make_gap = make_gap;
  return callbacks;
}

void Service::opened(net::SessionId id, const net::PeerInfo& peer) {
  guests_.try_emplace(id, id, peer.counted_as, gatekeeper_, config_.limits, parts_, requests_memory_);
  metrics_.sessions.Increment();
  spdlog::info("session={} peer={} websocket={} tls={} opened", id, peer.address, peer.websocket, peer.tls);
}

void Service::received(net::SessionId id, net::ReceivedMessage message) {
  const auto found = guests_.find(id);
  if (found == guests_.end()) return;
  SessionGate& gate = found->second.gate;
  SessionGate::Verdict verdict = gate.receive(std::move(message), steady_clock::now());
  if (verdict.unread && verdict.unread->message.bytes.size() <= base::message_bytes_max_at_once) {
    const Unread unread = std::move(*verdict.unread);
    verdict = gate.pass(unread.request_id, read_request(unread, found->second.requests), steady_clock::now());
  }
  if (verdict.unread) return read_apart(id, std::move(*verdict.unread));
  act_on(found->second, std::move(verdict));
}

// What a client has sent may wait for longer than it stays.
base::MemoryBudget Service::requests_of(const std::string& client) {
  constexpr std::size_t kept_beside_guests = 64;
  if (requests_of_.size() > 2 * guests_.size() + kept_beside_guests) {
    std::set<std::string> here;
    for (const auto& [id, guest] : guests_) here.insert(guest.gate.client());
    std::erase_if(requests_of_, [&](const auto& of) { return of.second.bytes() == 0 && !here.contains(of.first); });
  }
  const std::size_t most = config_.limits.requests_memory_bytes_max / client_requests_share;
  return requests_of_.try_emplace(client, most, requests_memory_).first->second;
}

// The session is not read meanwhile, so its requests stay in order and wait in its own socket.
void Service::read_apart(net::SessionId id, Unread unread) {
  const std::uint64_t request_id = unread.request_id;
  auto shared = std::make_shared<const Unread>(std::move(unread));
  auto read = [this, id, request_id, shared = std::move(shared), memory = guests_.at(id).requests] {
    auto message = std::make_shared<base::Result<ReadMessage>>(read_request(*shared, memory));
    server_.post([this, id, request_id, message = std::move(message)] {
      const auto found = guests_.find(id);
      if (found == guests_.end()) return;
      act_on(found->second, found->second.gate.pass(request_id, std::move(*message), steady_clock::now()));
      server_.resume(id);
    });
  };
  if (reader_.try_post(std::move(read), 0, {})) return server_.hold(id);
  Guest& guest = guests_.at(id);
  const Status going_down(StatusCode::unavailable, "the server shuts down");
  act_on(guest, guest.gate.pass(request_id, going_down, steady_clock::now()));
}

void Service::act_on(Guest& guest, SessionGate::Verdict verdict) {
  const net::SessionId id = guest.id;
  if (verdict.authenticated) {
    const GrantPtr& grant = guest.gate.grant();
    guest.session = std::make_shared<Session>(id, guest.gate.client(), grant);
    guest.requests = requests_of(guest.gate.client());
    server_.authenticated(id);
    spdlog::info("session={} client={} said hello token={} role={}", id, log_name(guest.gate.client_name()),
                 grant->token_id.empty() ? "none" : grant->token_id, name_of(grant->role));
  }
  if (verdict.is_over_rate) server_.pause_reading(id, over_rate_pause);
  if (verdict.pong_nonce) server_.pong(id, *verdict.pong_nonce);
  if (verdict.reply) {
    if (verdict.reply->has_error()) {
      const v1::Error& error = verdict.reply->error();
      metrics_.count_command("refused", v1::Error::Code_Name(error.code()));
      spdlog::debug("session={} refused: {}", id, error.what());
    }
    server_.send(id, serialise(*verdict.reply));
  }
  if (verdict.close) server_.close(id, *verdict.close);
  if (verdict.request) route(guest, std::move(*verdict.request));
}

void Service::closed(net::SessionId id, const Status& why) {
  const auto found = guests_.find(id);
  if (found == guests_.end()) return;
  count_sessions();
  for (const std::string& world : found->second.worlds) host_->session_ended(id, world);
  if (const auto& session = found->second.session; session != nullptr) {
    for (const std::string& world : session->end()) host_->end_owned(session, world);
  }
  parts_.session_ended(id);
  guests_.erase(found);
  metrics_.sessions.Decrement();
  spdlog::info("session={} closed: {}", id, why.ok() ? "by the client" : why.message());
}

void Service::route(Guest& guest, ReadMessage read) {
  const v1::ClientMessage& message = *read.message;
  Request request{guest.session, std::move(read.message), read.bytes};
  switch (message.request_case()) {
    case v1::ClientMessage::kListWorlds: {
      v1::ServerMessage reply;
      reply.set_request_id(message.request_id());
      v1::WorldList& list = *reply.mutable_world_list();
      for (WorldStatus& status : host_->statuses()) {
        if (guest.session->grant().worlds.covers(status.listing.name())) {
          *list.add_worlds() = std::move(status.listing);
        }
      }
      metrics_.count_command("list_worlds", "ok");
      return server_.send(guest.id, serialise(reply));
    }
    case v1::ClientMessage::kRequestKey:
      host_->ask_stream(message.request_key().stream_id(), std::move(request));
      return;
    case v1::ClientMessage::kReadSnapshot:
      return host_->read_snapshot(std::move(request));
    case v1::ClientMessage::kCreateWorld:
    case v1::ClientMessage::kRestoreWorld:
      return host_->create(std::move(request));
    case v1::ClientMessage::kUnsubscribe:
      host_->ask_stream(message.unsubscribe().stream_id(), std::move(request));
      return;
    default: {
      const std::string* named = world_of(message);
      if (named == nullptr) {
        const Status failed(StatusCode::internal, "the server does not know where this request belongs");
        return server_.send(guest.id, serialise(error_reply(message.request_id(), failed)));
      }
      const std::string world = *named;
      if (message.has_get_stats()) request.reader = server_.reader_stats(guest.id);
      if (host_->ask(world, std::move(request))) remember(guest, world);
      return;
    }
  }
}

// Worlds come and go; those that are gone hold nothing.
void Service::remember(Guest& guest, const std::string& world) {
  guest.worlds.insert(world);
  if (guest.worlds.size() <= config_.limits.worlds_max) return;
  std::erase_if(guest.worlds, [this](const std::string& name) { return !host_->has(name); });
}

// Nobody who said a token gets no grant, and is not refused.
Gatekeeper::Verdict Service::who_reads(const net::PageRequest& asked) {
  if (gatekeeper_.asks_for_tokens() && asked.authorization.empty()) return {};
  return gatekeeper_.admit(bearer_token(asked.authorization).value_or(""), std::string(asked.counted_as),
                           steady_clock::now(), wall_clock_now());
}

net::HttpReply Service::page(const net::PageRequest& asked) {
  const std::string_view path = asked.path;
  if (path == "/livez") return live_page();
  if (path == "/readyz") return ready_page(recent_statuses());
  const bool is_file = path != "/worlds" && path != "/healthz" && path != "/metrics";
  if (is_file) {
    if (const net::HttpReply* file = web_.find(path)) return *file;
    if (path != "/") return net::text_reply(404, "nothing here\n");
  }
  const Gatekeeper::Verdict reader = who_reads(asked);
  const GrantPtr& grant = reader.grant;
  const MayName may_name = [&grant](std::string_view world) { return grant != nullptr && grant->worlds.covers(world); };
  const std::string may_read = grant == nullptr ? "" : grant->worlds.text();
  if (path == "/healthz") {
    return pages_.get("/healthz " + may_read, steady_clock::now,
                      [&] { return health_page(recent_statuses(), steady_clock::now(), may_name); });
  }
  if (reader.retry_after_s > 0.0) return net::text_reply(429, reader.refusal.what() + "\n");
  if (!reader.refusal.ok()) return token_wanted_page();
  if (path == "/metrics") {
    return pages_.get("/metrics " + may_read, steady_clock::now, [&] {
      count_sessions();
      const double dropped = static_cast<double>(log_lines_dropped());
      metrics_.log_lines_dropped.Increment(dropped - metrics_.log_lines_dropped.Value());
      return metrics_page(metrics_, recent_statuses(), steady_clock::now(), may_name);
    });
  }
  if (grant == nullptr) return token_wanted_page();
  return pages_.get("/worlds " + may_read, steady_clock::now, [&] { return start_page(recent_statuses(), may_name); });
}

const std::vector<WorldStatus>& Service::recent_statuses() {
  constexpr std::chrono::milliseconds recent{100};
  const auto now = steady_clock::now();
  if (!statuses_at_ || now - *statuses_at_ >= recent) {
    statuses_ = host_->statuses();
    statuses_at_ = now;
  }
  return statuses_;
}

void Service::count_sessions() {
  std::size_t queue_bytes = 0;
  for (auto& [id, guest] : guests_) {
    const auto stats = server_.stats(id);
    if (!stats) continue;
    metrics_.count_session(guest.counted, *stats);
    guest.counted = *stats;
    queue_bytes += stats->queue_bytes;
  }
  metrics_.queue_bytes.Set(static_cast<double>(queue_bytes));
}

}  // namespace pneuma::app
