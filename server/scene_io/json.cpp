#include "scene_io/json.h"

#include "scene_io/duplicate_keys.h"
#include "scene_io/message_reader.h"

namespace pneuma::scene_io {
namespace {

template <class Message>
base::Result<Message> parse(std::string_view text) {
  if (auto status = check_keys(text); !status.ok()) return status;  // before the text becomes a tree
  const auto value = parse_json(text);
  if (!value.ok()) return value.status();
  Message message;
  if (auto status = read_message(*value, message); !status.ok()) return status;
  return message;
}

}  // namespace

base::Result<v1::Scene> parse_scene_json(std::string_view text) {
  return parse<v1::Scene>(text);
}

base::Result<v1::SceneEdit> parse_edit_json(std::string_view text) {
  return parse<v1::SceneEdit>(text);
}

}  // namespace pneuma::scene_io
