// No bytes from a client may crash the gate, or take more memory than is said before they are parsed.
// Input: a message of class ClientMessage, which comes whole and in parts of the size that the first byte tells.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "app/message_memory.h"
#include "app/request_kinds.h"
#include "app/session_gate.h"

using namespace pneuma;

namespace {

const base::MemoryBudget plenty(std::size_t{1} << 32U);
const app::SessionGate::TimePoint now = app::SessionGate::TimePoint() + std::chrono::hours(1);

app::SessionGate::Verdict say(app::SessionGate& gate, std::string_view bytes) {
  app::SessionGate::Verdict verdict = gate.receive({std::string(bytes), {}}, now);
  if (!verdict.unread) return verdict;
  return gate.pass(verdict.unread->request_id, app::read_request(*verdict.unread, plenty), now);
}

/// A request goes to a world, or is one of those that need none.
void must_have_a_place(const app::SessionGate::Verdict& verdict) {
  if (!verdict.request || app::world_of(*verdict.request->message) != nullptr) return;
  using Request = v1::ClientMessage;
  constexpr std::array placeless{Request::kListWorlds, Request::kCreateWorld,  Request::kUnsubscribe,
                                 Request::kRequestKey, Request::kReadSnapshot, Request::kRestoreWorld};
  if (std::ranges::find(placeless, verdict.request->message->request_case()) == placeless.end()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t part_bytes = 1 + bytes[0];
  const std::string_view message(reinterpret_cast<const char*>(bytes) + 1, size - 1);

  v1::ClientMessage parsed;
  if (parsed.ParseFromArray(message.data(), static_cast<int>(message.size())) &&
      app::measure_message(message, *v1::ClientMessage::descriptor(), {parsed.SpaceUsedLong() - 1, message.size()})
          .ok()) {
    std::abort();
  }

  const base::Limits limits;
  app::MessageParts parts(limits);
  app::Gatekeeper open;
  app::SessionGate gate(1, "", open, limits, parts);
  v1::ClientMessage hello;
  hello.set_request_id(1);
  hello.mutable_hello()->set_protocol_version(base::protocol_version);
  if (!say(gate, hello.SerializeAsString()).authenticated) std::abort();
  must_have_a_place(say(gate, message));
  for (std::size_t begin = 0; begin < message.size(); begin += part_bytes) {
    v1::ClientMessage part;
    part.set_request_id(parsed.request_id());
    part.mutable_part()->set_data(std::string(message.substr(begin, part_bytes)));
    part.mutable_part()->set_last(message.size() - begin <= part_bytes);
    must_have_a_place(say(gate, part.SerializeAsString()));
  }
  return 0;
}
