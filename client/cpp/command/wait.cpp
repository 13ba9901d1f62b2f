// `pneuma wait`: until a world has done so many ticks, or something happens in it.
#include <algorithm>
#include <charconv>
#include <chrono>
#include <variant>

#include "command/commands.h"
#include "command/event_lines.h"
#include "command/interrupt.h"

namespace pneuma::client {

namespace {

using Clock = std::chrono::steady_clock;

class Wait {
 public:
  Wait(Session& session, const WaitArguments& arguments, const Awaited& awaited)
      : session_(session), arguments_(arguments), awaited_(awaited) {}

  base::Status run();

 private:
  base::Status take(const DecodedFrame& frame) { return reached(frame.tick); }
  base::Status take(const v1::Gap& gap) { return reached(gap.to_tick()); }
  base::Status take(const v1::Applied&) { return {}; }  // not asked for
  base::Status take(const StreamFault&) { return {}; }  // ticks go on
  base::Status take(const v1::Event& event);
  base::Status reached(std::uint64_t tick);
  [[nodiscard]] base::Status not_in_time() const;

  Session& session_;
  const WaitArguments& arguments_;
  const Awaited& awaited_;
  std::optional<std::uint64_t> tick_;  // the last that was seen
  bool done_ = false;
};

base::Status Wait::run() {
  const auto limit = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(arguments_.timeout_s));
  const auto deadline = Clock::now() + limit;
  SubscribeOptions stream;
  if (awaited_.event) stream.rate_hz = 1.0;  // events come whatever the rate
  const auto subscribed = session_.client.subscribe(arguments_.world, stream);
  if (!subscribed.ok()) return subscribed.status();
  base::Status status;
  while (status.ok() && !done_) {
    const auto now = Clock::now();
    if (now >= deadline || interrupted()) return not_in_time();
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - now);
    const auto update = session_.client.next_update(std::min(left, interrupt_patience));
    if (!update.ok()) return update.status();
    if (*update) status = std::visit([this](const auto& one) { return take(one); }, **update);
  }
  return status;
}

base::Status Wait::reached(std::uint64_t tick) {
  tick_ = tick;
  if (!awaited_.tick || tick < *awaited_.tick) return {};
  done_ = true;
  if (session_.json) {
    return session_.output.line(JsonObject().add("world", arguments_.world).add("tick", tick).text());
  }
  return session_.output.line(arguments_.world + " at tick " + std::to_string(tick));
}

base::Status Wait::take(const v1::Event& event) {
  if (event.world() != arguments_.world) return {};
  if (awaited_.event && event.kind() == *awaited_.event) {
    done_ = true;
    return session_.output.line(session_.json ? event_json(event).text() : event_text(event));
  }
  if (event.kind() != v1::Event::WORLD_DESTROYED) return {};
  return base::not_found("the world was destroyed", arguments_.world);
}

base::Status Wait::not_in_time() const {
  std::string what = interrupted() ? "interrupted" : "not within " + number_text(arguments_.timeout_s) + " s";
  what += " (--until " + arguments_.until + ")";
  if (tick_) what += "; it is at tick " + std::to_string(*tick_);
  return {base::StatusCode::unavailable, std::move(what), arguments_.world};
}

}  // namespace

std::optional<Awaited> parse_awaited(const std::string& text) {
  std::uint64_t tick = 0;
  const char* const end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, tick);
  if (parsed.ec == std::errc() && parsed.ptr == end) return Awaited{.tick = tick, .event = {}};
  std::string name = text;
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return c == '-' ? '_' : static_cast<char>(std::toupper(c)); });
  v1::Event::Kind kind = v1::Event::KIND_UNSPECIFIED;
  if (!v1::Event::Kind_Parse(name, &kind) || kind == v1::Event::KIND_UNSPECIFIED) return std::nullopt;
  return Awaited{.tick = {}, .event = kind};
}

base::Status wait(Session& session, const WaitArguments& arguments) {
  catch_interrupts();
  const Awaited awaited = parse_awaited(arguments.until).value();  // checked as a flag
  return Wait(session, arguments, awaited).run();
}

}  // namespace pneuma::client
