// NaN and infinity, wherever a message may hold them.
#pragma once

#include <google/protobuf/message.h>

#include "base/status.h"

namespace pneuma::scene_io {

/// Refuses a message with a number, however deep, that is not finite; `where` is the path of the first.
[[nodiscard]] base::Status check_finite(const google::protobuf::Message& message);

}  // namespace pneuma::scene_io
