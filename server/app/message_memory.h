// What a protobuf message will take in memory, found from its bytes before it is parsed: empty fields are small on the
// wire alone.
#pragma once

#include <cstddef>
#include <string_view>

#include <google/protobuf/descriptor.h>

namespace pneuma::app {

/// Whether what parsing makes of the bytes takes at most `bytes_max` of memory, within the allocator's rounding. True
/// of bytes that are no such message if all that comes before that shows does.
[[nodiscard]] bool takes_at_most(std::string_view bytes, const google::protobuf::Descriptor& descriptor,
                                 std::size_t bytes_max);

}  // namespace pneuma::app
