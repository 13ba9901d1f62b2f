// What can be told of a client's message before it is parsed: which request it is, and its id.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

struct Envelope {
  std::uint64_t request_id = 0;
  v1::ClientMessage::RequestCase request = v1::ClientMessage::REQUEST_NOT_SET;  // not set: none that is known
  std::string_view body;                                                        // the bytes of the request
};

/// Looks at the fields of the message itself and at none within them. Nothing where the bytes are no ClientMessage,
/// have more fields than envelope_fields_max, or two requests.
[[nodiscard]] std::optional<Envelope> read_envelope(std::string_view bytes);

/// A Part, whose data is a view of `body`; nothing where it is none, or has more fields than envelope_fields_max.
struct PartView {
  std::string_view data;
  bool last = false;
};
[[nodiscard]] std::optional<PartView> read_part(std::string_view body);

}  // namespace pneuma::app
