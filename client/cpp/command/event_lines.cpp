#include "command/event_lines.h"

namespace pneuma::client {

std::string event_text(const v1::Event& event) {
  std::string text = v1::Event::Kind_Name(event.kind()) + " " + event.world();
  if (!event.body().empty()) text += " " + event.body();
  if (!event.joint().empty()) text += " " + event.joint();
  text += " at tick " + std::to_string(event.tick());
  if (!event.detail().empty()) text += ": " + event.detail();
  return text;
}

JsonObject event_json(const v1::Event& event) {
  JsonObject told;
  told.add("type", "event").add("kind", v1::Event::Kind_Name(event.kind()));
  told.add("world", event.world()).add("body", event.body());
  if (!event.joint().empty()) told.add("joint", event.joint());
  told.add("tick", event.tick()).add("detail", event.detail());
  return told;
}

}  // namespace pneuma::client
