// JSON into any message of scene.proto, by reflection. protobuf's own reader does not say where a value was wrong.
#pragma once

#include <string_view>

#include <boost/json/value.hpp>
#include <google/protobuf/message.h>

#include "base/status.h"

namespace pneuma::scene_io {

/// Fails with `where` as "line 3, column 7".
[[nodiscard]] base::Result<boost::json::value> parse_json(std::string_view text);

/// Merges an object into `message`; on failure `where` is the path from it, and the message is left half-read.
[[nodiscard]] base::Status read_message(const boost::json::value& value, google::protobuf::Message& message);

/// Puts a value in the place of what the field holds; null clears it.
[[nodiscard]] base::Status read_field(const boost::json::value& value, google::protobuf::Message& message,
                                      const google::protobuf::FieldDescriptor& field);

/// By its snake_case or lowerCamelCase name; the error offers the nearest one.
[[nodiscard]] base::Result<const google::protobuf::FieldDescriptor*> find_field(
    const google::protobuf::Descriptor& descriptor, std::string_view name);

}  // namespace pneuma::scene_io
