// How large a protobuf message will be, found from its bytes before it is parsed: empty fields are small on the wire
// alone.
#pragma once

#include <cstddef>
#include <string_view>

#include <google/protobuf/descriptor.h>

#include "base/status.h"

namespace pneuma::app {

struct MessageSize {
  std::size_t bytes = 0;   // of memory, within the allocator's rounding
  std::size_t fields = 0;  // those of messages within it too; a packed list is one
};

/// What parsing makes of the bytes, on the heap or on an arena. Refused with LIMIT_EXCEEDED where that would pass
/// `most`, or nest deeper than base::message_depth_max. Of bytes that are no such message: what comes before that
/// shows.
[[nodiscard]] base::Result<MessageSize> measure_message(std::string_view bytes,
                                                        const google::protobuf::Descriptor& descriptor,
                                                        const MessageSize& most);

}  // namespace pneuma::app
