#include "scene_io/edit_path.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

namespace pneuma::scene_io {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// `soft_bodies[2].mesh` in its three parts; the last one begins with its dot.
struct ScenePath {
  std::string_view field;
  std::optional<int> index;
  std::string_view rest;
};

ScenePath parse(std::string_view path) {
  const std::size_t end = std::min(path.find_first_of(".["), path.size());
  ScenePath parsed{path.substr(0, end), std::nullopt, path.substr(end)};
  const std::size_t close = parsed.rest.find(']');
  if (!parsed.rest.starts_with('[') || close == std::string_view::npos) return parsed;
  int index = 0;
  if (std::from_chars(parsed.rest.data() + 1, parsed.rest.data() + close, index).ec == std::errc()) {
    parsed.index = index;
    parsed.rest.remove_prefix(close + 1);
  }
  return parsed;
}

/// The scene's list, and how a change names one of its things.
constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kinds{{{"meshes", "mesh"},
                                                                              {"soft_bodies", "soft_body"},
                                                                              {"rigid_bodies", "rigid_body"},
                                                                              {"colliders", "collider"},
                                                                              {"joints", "joint"}}};

std::string name_of(const Message& thing) {
  return thing.GetReflection()->GetString(thing, thing.GetDescriptor()->FindFieldByName("name"));
}

/// The first field of `.gas.moles` is set in the message.
bool holds(const Message& message, std::string_view rest) {
  if (rest.empty()) return true;
  rest.remove_prefix(1);
  const std::string first(rest.substr(0, rest.find_first_of(".[")));
  const FieldDescriptor* field = message.GetDescriptor()->FindFieldByName(first);
  if (field == nullptr) return false;
  const auto* reflection = message.GetReflection();
  return field->is_repeated() ? reflection->FieldSize(message, field) > 0 : reflection->HasField(message, field);
}

/// What a scene has as a list, pins with a flag beside it, a change has as a message.
std::string in_change_of_soft_body(std::string_view rest) {
  constexpr std::string_view list = ".pins";
  constexpr std::string_view masses = ".vertex_mass_scale";
  if (rest.starts_with(masses)) return std::string(masses) + ".scale" + std::string(rest.substr(masses.size()));
  if (rest == ".pin_boundary") return ".pins.boundary";
  if (rest.starts_with(list)) return ".pins.vertices" + std::string(rest.substr(list.size()));
  return std::string(rest);
}

/// The path from the change's own field, where the change adds or changes the thing; nothing where it does not.
std::optional<std::string> path_in(const Message& made, const std::string& change, const std::string& kind,
                                   const std::string& name, std::string_view rest) {
  if (change == "add_" + kind && name_of(made) == name) return std::string(rest);
  if (change != "change_" + kind || name_of(made) != name) return std::nullopt;
  std::string path = kind == "soft_body" ? in_change_of_soft_body(rest) : std::string(rest);
  if (!holds(made, path)) return std::nullopt;
  return path;
}

/// The same for what a scene has once.
std::optional<std::string> path_in(const Message& made, const std::string& change, const ScenePath& path) {
  constexpr std::string_view wind = ".wind";
  if (change == "set_wind" && path.field == "atmosphere" && path.rest.starts_with(wind)) {
    return std::string(path.rest.substr(wind.size()));
  }
  if (change != "set_" + std::string(path.field) || !holds(made, path.rest)) return std::nullopt;
  return std::string(path.rest);
}

}  // namespace

base::Status by_change(const base::Status& status, const v1::Scene& edited, const v1::SceneEdit& edit) {
  const ScenePath path = parse(status.where());
  const auto kind = std::find_if(kinds.begin(), kinds.end(), [&](const auto& its) { return its.first == path.field; });
  const FieldDescriptor* list = v1::Scene::descriptor()->FindFieldByName(std::string(path.field));
  std::string name;
  if (kind != kinds.end() && path.index && *path.index < edited.GetReflection()->FieldSize(edited, list)) {
    name = name_of(edited.GetReflection()->GetRepeatedMessage(edited, list, *path.index));
  }
  for (int i = edit.changes_size() - 1; i >= 0; --i) {
    const v1::SceneChange& change = edit.changes(i);
    const FieldDescriptor* field =
        v1::SceneChange::descriptor()->FindFieldByNumber(static_cast<int>(change.change_case()));
    if (field == nullptr || field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    const Message& made = change.GetReflection()->GetMessage(change, field);
    const auto found = kind == kinds.end() ? path_in(made, field->name(), path)
                                           : path_in(made, field->name(), std::string(kind->second), name, path.rest);
    if (!found) continue;
    std::string where("changes[");
    where.append(std::to_string(i)).append("].").append(field->name()).append(*found);
    return {status.code(), status.what(), where};
  }
  return {status.code(), status.message()};
}

}  // namespace pneuma::scene_io
