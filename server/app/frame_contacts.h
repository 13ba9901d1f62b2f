// The contacts that a stream's frame tells.
#pragma once

#include "app/frame_source.h"
#include "app/layout.h"
#include "pneuma/v1/frame.pb.h"

namespace pneuma::app {

/// Of the layout's bodies, by body and vertex; at most base::frame_contacts_max. Of more, a choice spread over the
/// vertices, and mostly the same from frame to frame while they last.
[[nodiscard]] google::protobuf::RepeatedPtrField<v1::Contact> contacts_of(const FrameSource& source,
                                                                          const WorldLayout& layout);

}  // namespace pneuma::app
