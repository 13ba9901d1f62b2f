// What a Subscribe may ask for.
#pragma once

#include "app/frame_source.h"
#include "base/status.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// Refuses numbers that cannot be, and what does not go together. Errors name the field.
[[nodiscard]] base::Status check_terms(const v1::Subscribe& request);

/// Refuses the same, and what `source` cannot give: bodies that it does not hold, what a recording lacks, and plain
/// frames of more bytes a second than a stream may have.
[[nodiscard]] base::Status check_subscribed(const v1::Subscribe& request, const FrameSource& source);

}  // namespace pneuma::app
