#include "app/scene_source.h"

#include "scene_io/json.h"
#include "scene_io/load.h"

namespace pneuma::app {

namespace {

base::Result<v1::Scene> inside(base::Result<v1::Scene> scene, const char* field) {
  if (scene.ok()) return scene;
  return scene.status().inside(field);
}

}  // namespace

std::string source_field(const v1::CreateWorld& request) {
  const auto* field = v1::CreateWorld::descriptor()->FindFieldByNumber(static_cast<int>(request.source_case()));
  return "create_world." + (field == nullptr ? std::string("source") : field->name());
}

base::Result<v1::Scene> scene_of(const v1::CreateWorld& request) {
  switch (request.source_case()) {
    case v1::CreateWorld::kBuiltin:
      return inside(scene_io::builtin_scene(request.builtin()), "create_world.builtin");
    case v1::CreateWorld::kScene:
      return request.scene();
    case v1::CreateWorld::kSceneJson:
      return inside(scene_io::parse_scene_json(request.scene_json()), "create_world.scene_json");
    case v1::CreateWorld::SOURCE_NOT_SET:
      break;
  }
  return base::invalid("names no scene", "create_world.source");
}

}  // namespace pneuma::app
