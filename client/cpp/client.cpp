#include "pneuma_client/client.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <functional>
#include <map>
#include <utility>

#include "base/limits.h"
#include "connection.h"

namespace pneuma::client {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using v1::ServerMessage;

// Of a message on the wire: its length.
constexpr std::size_t length_prefix_bytes = 4;
// Between two requests for a key frame of a stream. One that always decodes wrong is shown by its key frames alone.
constexpr std::chrono::seconds key_request_interval{1};
// Of a part, at most: ids, lengths and the flag.
constexpr std::size_t part_head_bytes = 32;

/// With the server's address where the status names no place of its own.
base::Status located(const base::Status& status, const std::string& address) {
  return status.where().empty() ? status.inside(address) : status;
}

}  // namespace

struct Client::Impl {
  explicit Impl(ConnectOptions given) : options(std::move(given)), decoder(options.topologies) {}

  base::Status open(const std::string& address);
  /// `timeout` counts from when the request has left, and is what each of its parts may take.
  base::Result<ServerMessage> call(v1::ClientMessage request, milliseconds timeout);
  /// In parts where it is larger than the server takes at once; what comes between them is taken in, and a reply to the
  /// request goes to `reply`.
  base::Status send(std::string bytes, std::uint64_t request_id, milliseconds timeout,
                    std::optional<ServerMessage>& reply);
  /// Takes in one message as receive() does; keeps no reply to another request than `request_id`.
  base::Result<bool> receive_reply(Deadline deadline, std::uint64_t request_id, std::optional<ServerMessage>& reply);
  /// Begins or ends the stream that the reply is about; an Error is its status.
  base::Status take_reply(const v1::ClientMessage& request, ServerMessage& reply);
  /// Waits for an update that `wanted` holds for, and takes it out.
  base::Result<std::optional<Update>> next(Deadline deadline, const std::function<bool(const Update&)>& wanted);

  /// Takes one message in: a reply goes to `reply`, what is unasked is kept. False when the deadline passes first.
  base::Result<bool> receive(Deadline deadline, std::optional<ServerMessage>& reply);
  base::Status take_unasked(ServerMessage& message, std::string_view bytes);
  /// Of a frame after which the stream waits for a key frame; `status` says why, or that it did before.
  base::Status take_fault(const v1::Frame& message, const base::Status& status);
  base::Status replace_stream(const v1::Event& event);
  /// The id that the stream had at first, as its reader knows it.
  [[nodiscard]] std::uint32_t first_id(std::uint32_t stream_id) const;
  /// The id that the server knows it by now.
  [[nodiscard]] std::uint32_t present_id(std::uint32_t stream_id) const;
  void keep(Update update);
  base::Status fail(base::Status status);

  ConnectOptions options;
  Connection connection;
  v1::Welcome welcome;
  StreamDecoder decoder;
  Tap tap;
  std::deque<Update> updates;
  std::map<std::uint32_t, std::uint32_t> first_ids;  // of streams that replaced others
  std::map<std::uint32_t, Clock::time_point> keys_asked_for;
  std::uint64_t last_request_id = 0;
  std::uint64_t updates_dropped = 0;
  std::uint64_t gaps = 0;
  std::uint64_t ticks_missed = 0;
  base::Status failure;
};

base::Status Client::Impl::open(const std::string& address) {
  const Deadline deadline = Clock::now() + options.connect_timeout;
  std::string host;
  std::string port;
  if (!split_address(address, host, port)) return base::invalid("not HOST:PORT", address);
  const base::Status opened = connection.open(host, port, options.tls, options.ca_file, deadline);
  if (!opened.ok()) return located(opened, address);

  welcome.set_message_bytes_max(base::message_bytes_max_before_hello);
  v1::ClientMessage request;
  request.mutable_hello()->set_protocol_version(base::protocol_version);
  request.mutable_hello()->set_token(options.token);
  request.mutable_hello()->set_client_name(options.client_name);
  auto reply = call(std::move(request), std::chrono::ceil<milliseconds>(deadline - Clock::now()));
  if (!reply.ok()) return located(reply.status(), address);
  if (!reply->has_welcome()) return {base::StatusCode::malformed, "a greeting that is no welcome", address};
  welcome = std::move(*reply->mutable_welcome());
  return {};
}

base::Status Client::Impl::fail(base::Status status) {
  failure = std::move(status);
  return failure;
}

base::Status Client::Impl::send(std::string bytes, std::uint64_t request_id, milliseconds timeout,
                                std::optional<ServerMessage>& reply) {
  if (bytes.size() <= welcome.message_bytes_max()) {
    connection.queue(bytes);
    return connection.flush(Clock::now() + timeout);
  }
  const std::size_t part_bytes = welcome.message_bytes_max() - part_head_bytes;
  for (std::size_t begin = 0; begin < bytes.size(); begin += part_bytes) {
    const Deadline deadline = Clock::now() + timeout;
    // A server whose pings wait until all parts have left takes a slow connection for a dead one.
    for (bool has_come = begin > 0; has_come && Clock::now() < deadline;) {
      const auto received = receive_reply(Clock::now(), request_id, reply);
      if (!received.ok()) return received.status();
      has_come = *received;
    }
    v1::ClientMessage part;
    part.set_request_id(request_id);
    part.mutable_part()->set_data(bytes.substr(begin, part_bytes));
    part.mutable_part()->set_last(bytes.size() - begin <= part_bytes);
    connection.queue(part.SerializeAsString());
    if (base::Status sent = connection.flush(deadline); !sent.ok()) return sent;
  }
  return {};
}

base::Result<bool> Client::Impl::receive_reply(Deadline deadline, std::uint64_t request_id,
                                               std::optional<ServerMessage>& reply) {
  std::optional<ServerMessage> any;
  auto received = receive(deadline, any);
  if (any && any->request_id() == request_id) reply = std::move(any);  // no late one to a call given up on
  return received;
}

base::Result<ServerMessage> Client::Impl::call(v1::ClientMessage request, milliseconds timeout) {
  if (!failure.ok()) return failure;
  if (request.has_unsubscribe()) {
    request.mutable_unsubscribe()->set_stream_id(present_id(request.unsubscribe().stream_id()));
  }
  const std::uint64_t id = ++last_request_id;
  request.set_request_id(id);
  std::string bytes = request.SerializeAsString();
  if (const std::size_t bytes_max = request_bytes_max(welcome); bytes.size() > bytes_max) {
    return base::Status(base::StatusCode::limit_exceeded, "a request of " + std::to_string(bytes.size()) +
                                                              " bytes; the server takes " + std::to_string(bytes_max));
  }
  std::optional<ServerMessage> reply;
  const base::Status sent = send(std::move(bytes), id, timeout, reply);
  const Deadline deadline = Clock::now() + timeout;
  // A server that closes says why first; that is worth more than the broken pipe.
  while (!reply && Clock::now() < deadline) {
    const auto received = receive_reply(deadline, id, reply);
    if (!received.ok()) return received.status();
  }
  if (!reply && !sent.ok()) return fail(sent);
  if (!reply) return base::Status(base::StatusCode::unavailable, "no reply in time");
  if (const base::Status taken = take_reply(request, *reply); !taken.ok()) return taken;
  return std::move(*reply);
}

base::Status Client::Impl::take_reply(const v1::ClientMessage& request, ServerMessage& reply) {
  if (reply.has_error()) return to_status(reply.error());
  if (reply.has_subscribed()) {
    const base::Status added = decoder.add_stream(reply.subscribed());
    if (!added.ok()) return fail(added);
    reply.mutable_subscribed()->set_stream_id(first_id(reply.subscribed().stream_id()));
  }
  if (reply.has_done() && request.has_unsubscribe()) {
    decoder.remove_stream(request.unsubscribe().stream_id());
    keys_asked_for.erase(request.unsubscribe().stream_id());
    first_ids.erase(request.unsubscribe().stream_id());
  }
  return {};
}

base::Result<bool> Client::Impl::receive(Deadline deadline, std::optional<ServerMessage>& reply) {
  if (!failure.ok()) return failure;
  auto bytes = connection.receive(deadline);
  if (!bytes.ok()) return fail(bytes.status());
  if (!*bytes) return false;
  ServerMessage message;
  if (!message.ParseFromString(**bytes)) {
    return fail({base::StatusCode::malformed, "a message that is no ServerMessage: not a pneuma-server"});
  }
  if (message.request_id() != 0) {
    reply = std::move(message);
    return true;
  }
  const base::Status taken = take_unasked(message, **bytes);
  if (!taken.ok()) return fail(taken);
  return true;
}

base::Status Client::Impl::take_unasked(ServerMessage& message, std::string_view bytes) {
  const auto understood = [&](const base::Status& status) {
    if (status.ok() && tap) tap(bytes, message);
    return status;
  };
  switch (message.message_case()) {
    case ServerMessage::kTopology:
      return understood(decoder.take_topology(message.topology()));
    case ServerMessage::kLayout:
      return understood(decoder.take_layout(message.layout()));
    case ServerMessage::kFrame: {
      auto frame = decoder.take_frame(message.frame(), bytes.size() + length_prefix_bytes);
      if (decoder.waits_for_key(message.frame().stream_id())) return take_fault(message.frame(), frame.status());
      if (!frame.ok()) return frame.status();
      if (!*frame) return {};
      (*frame)->stream_id = first_id((*frame)->stream_id);
      keep(std::move(**frame));
      return understood({});
    }
    case ServerMessage::kGap:
      if (!decoder.has_stream(message.gap().stream_id())) return {};
      ++gaps;
      ticks_missed += message.gap().to_tick() - message.gap().from_tick() + 1;
      message.mutable_gap()->set_stream_id(first_id(message.gap().stream_id()));
      keep(message.gap());
      return understood({});
    case ServerMessage::kEvent:
      if (message.event().kind() == v1::Event::STREAM_REPLACED) {
        if (const base::Status replaced = replace_stream(message.event()); !replaced.ok()) return replaced;
      }
      keep(message.event());
      return understood({});
    case ServerMessage::kApplied:
      keep(message.applied());
      return understood({});
    case ServerMessage::kPing: {
      v1::ClientMessage pong;
      pong.set_request_id(++last_request_id);
      pong.mutable_pong()->set_nonce(message.ping().nonce());
      connection.queue(pong.SerializeAsString());
      return {};
    }
    case ServerMessage::kError:
      return to_status(message.error());
    case ServerMessage::kGoodbye: {
      const base::Status reason = to_status(message.goodbye().reason());
      return {reason.code(), "the server said goodbye: " + reason.what(), reason.where()};
    }
    default:
      return {};  // of a newer server
  }
}

base::Status Client::Impl::take_fault(const v1::Frame& message, const base::Status& status) {
  const bool key = !message.has_base_tick();
  if (key) return status;
  if (!status.ok()) keep(StreamFault{first_id(message.stream_id()), message.tick(), status});
  const Clock::time_point now = Clock::now();
  const auto asked = keys_asked_for.find(message.stream_id());
  if (asked != keys_asked_for.end() && now < asked->second + key_request_interval) return {};
  keys_asked_for[message.stream_id()] = now;
  v1::ClientMessage request;
  request.set_request_id(++last_request_id);
  request.mutable_request_key()->set_stream_id(message.stream_id());
  connection.queue(request.SerializeAsString());  // of its reply nothing is needed: the key frame says it
  return {};
}

base::Status Client::Impl::replace_stream(const v1::Event& event) {
  const std::uint32_t ended = event.stream_id();
  if (!decoder.has_stream(ended)) return {};
  const base::Status added = decoder.add_stream(event.successor());
  if (!added.ok()) return added;
  const std::uint32_t first = first_id(ended);
  decoder.remove_stream(ended);
  keys_asked_for.erase(ended);
  first_ids.erase(ended);
  if (first != event.successor().stream_id()) first_ids[event.successor().stream_id()] = first;
  return {};
}

std::uint32_t Client::Impl::first_id(std::uint32_t stream_id) const {
  const auto found = first_ids.find(stream_id);
  return found == first_ids.end() ? stream_id : found->second;
}

std::uint32_t Client::Impl::present_id(std::uint32_t stream_id) const {
  for (const auto& [present, first] : first_ids) {
    if (first == stream_id) return present;
  }
  return stream_id;
}

void Client::Impl::keep(Update update) {
  if (updates.size() == updates_max) {
    updates.pop_front();
    ++updates_dropped;
  }
  updates.push_back(std::move(update));
}

base::Result<std::optional<Update>> Client::Impl::next(Deadline deadline,
                                                       const std::function<bool(const Update&)>& wanted) {
  std::size_t late = 0;  // messages taken past the deadline: those that have come count, a flood must not hold us
  while (late <= updates_max) {
    const auto found = std::ranges::find_if(updates, wanted);
    if (found != updates.end()) {
      std::optional<Update> update(std::move(*found));
      updates.erase(found);
      return update;
    }
    std::optional<ServerMessage> late_reply;
    const auto received = receive(deadline, late_reply);
    if (!received.ok()) return received.status();
    if (!*received) break;
    if (Clock::now() >= deadline) ++late;
  }
  return std::optional<Update>();
}

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

base::Result<Client> Client::connect(const std::string& address, const ConnectOptions& options) {
  auto impl = std::make_unique<Impl>(options);
  const base::Status opened = impl->open(address);
  if (!opened.ok()) return opened;
  return Client(std::move(impl));
}

const v1::Welcome& Client::welcome() const {
  return impl_->welcome;
}

base::Result<ServerMessage> Client::call(v1::ClientMessage request, milliseconds timeout) {
  if (timeout == milliseconds(0)) timeout = impl_->options.reply_timeout;
  return impl_->call(std::move(request), timeout);
}

base::Result<std::optional<Update>> Client::next_update(milliseconds timeout) {
  return impl_->next(Clock::now() + timeout, [](const Update&) { return true; });
}

namespace {

template <class Kind>
bool is(const Update& update) {
  return std::holds_alternative<Kind>(update);
}

template <class Kind>
base::Result<std::optional<Kind>> as(base::Result<std::optional<Update>> update) {
  if (!update.ok()) return update.status();
  if (!*update) return std::optional<Kind>();
  return std::optional<Kind>(std::get<Kind>(std::move(**update)));
}

}  // namespace

base::Result<std::optional<DecodedFrame>> Client::next_frame(milliseconds timeout) {
  return as<DecodedFrame>(impl_->next(Clock::now() + timeout, is<DecodedFrame>));
}

base::Result<std::optional<v1::Event>> Client::next_event(milliseconds timeout) {
  return as<v1::Event>(impl_->next(Clock::now() + timeout, is<v1::Event>));
}

void Client::set_tap(Tap tap) {
  impl_->tap = std::move(tap);
}

std::uint64_t Client::updates_dropped() const {
  return impl_->updates_dropped;
}
std::uint64_t Client::gaps() const {
  return impl_->gaps;
}
std::uint64_t Client::ticks_missed() const {
  return impl_->ticks_missed;
}
std::vector<TopologyPtr> Client::topologies() const {
  return impl_->decoder.topologies();
}

std::size_t request_bytes_max(const v1::Welcome& welcome) {
  const bool takes_parts = welcome.message_bytes_max() > part_head_bytes;
  return takes_parts ? std::max(welcome.message_bytes_max(), welcome.parts_bytes_max()) : welcome.message_bytes_max();
}

bool split_address(std::string_view address, std::string& host, std::string& port) {
  const std::size_t colon = address.rfind(':');
  if (colon == std::string_view::npos || colon == 0 || colon + 1 == address.size()) return false;
  std::string_view name = address.substr(0, colon);
  const std::string_view number = address.substr(colon + 1);
  if (name.starts_with('[') && name.ends_with(']')) {
    name = name.substr(1, name.size() - 2);
  } else if (name.find(':') != std::string_view::npos) {
    return false;  // a V6 address needs its brackets
  }
  unsigned value = 0;
  const auto parsed = std::from_chars(number.data(), number.data() + number.size(), value);
  if (parsed.ec != std::errc() || parsed.ptr != number.data() + number.size() || value == 0 || value > 65535)
    return false;
  if (name.empty()) return false;
  host = name;
  port = number;
  return true;
}

base::Status to_status(const v1::Error& error) {
  using Code = base::StatusCode;
  const auto code = [&] {
    switch (error.code()) {
      case v1::Error::INVALID_ARGUMENT:
        return Code::invalid_argument;
      case v1::Error::NOT_FOUND:
        return Code::not_found;
      case v1::Error::ALREADY_EXISTS:
        return Code::already_exists;
      case v1::Error::LIMIT_EXCEEDED:
        return Code::limit_exceeded;
      case v1::Error::UNAUTHENTICATED:
      case v1::Error::PERMISSION_DENIED:  // the token is good, and not for this
        return Code::unauthenticated;
      case v1::Error::FAILED_PRECONDITION:
        return Code::failed_precondition;
      case v1::Error::UNSUPPORTED:
        return Code::unsupported;
      case v1::Error::MALFORMED:
        return Code::malformed;
      case v1::Error::UNAVAILABLE:
        return Code::unavailable;
      default:
        return Code::internal;
    }
  }();
  std::string what = error.what();
  if (error.retry_after_s() > 0.0) {
    what += " (try again in " + std::to_string(static_cast<int>(std::ceil(error.retry_after_s()))) + " s)";
  }
  return {code, std::move(what), error.where()};
}

}  // namespace pneuma::client
