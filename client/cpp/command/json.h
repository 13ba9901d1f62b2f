// JSON as the `pneuma` command prints it: one object a line for scripts, scenes in their file form.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include <google/protobuf/message.h>

#include "base/status.h"
#include "pneuma/v1/scene.pb.h"

namespace pneuma::client {

/// In quotes, with what must not stand in them escaped.
[[nodiscard]] std::string json_string(std::string_view text);

/// The members of a JSON object, in order.
class JsonObject {
 public:
  JsonObject& add(std::string_view key, std::string_view text);
  JsonObject& add(std::string_view key, const char* text) { return add(key, std::string_view(text)); }
  JsonObject& add(std::string_view key, bool value);
  JsonObject& add(std::string_view key, double value);
  JsonObject& add(std::string_view key, std::uint64_t value);
  JsonObject& add(std::string_view key, std::span<const double> values);
  JsonObject& add(std::string_view key, std::span<const std::string> texts);
  JsonObject& add(std::string_view key, std::span<const JsonObject> values);
  JsonObject& add(std::string_view key, const JsonObject& value) { return add_raw(key, value.text()); }
  /// `json` as it stands.
  JsonObject& add_raw(std::string_view key, std::string_view json);
  [[nodiscard]] std::string text() const { return "{" + members_ + "}"; }

 private:
  std::string members_;
};

/// A reply, its fields named as in the .proto files: every field, also those at zero, but the messages and optional
/// fields that are not set. Every number is a JSON number (protobuf's own mapping quotes those of 64 bits); a fixed64,
/// which is a hash, is hexadecimal text. For messages without bytes and maps.
[[nodiscard]] JsonObject reply_json(const google::protobuf::Message& message);

/// The file form of a scene, for people over several lines.
enum class SceneForm { one_line, for_people };
[[nodiscard]] std::string scene_json(const v1::Scene& scene, SceneForm form);

/// A failure for scripts: {"error":{"code":...,"where":...,"what":...}}, its code named as in Error of session.proto.
[[nodiscard]] std::string error_json(const base::Status& status);

/// As in "0x00000000000000ff".
[[nodiscard]] std::string hash_text(std::uint64_t hash);

}  // namespace pneuma::client
