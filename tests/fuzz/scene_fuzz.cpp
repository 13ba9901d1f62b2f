// No text may crash the readers of scenes and edits, and each is taken, and a scene then translated, or refused in
// words. Where it begins: the built-in scenes.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "scene_io/json.h"
#include "scene_io/translate.h"

using namespace pneuma;

namespace {

void must_be_told(const base::Status& status) {
  if (!status.ok() && status.message().empty()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  must_be_told(scene_io::parse_edit_json(text).status());
  const auto scene = scene_io::parse_scene_json(text);
  must_be_told(scene.status());
  if (scene.ok()) must_be_told(scene_io::to_physics(*scene).status());
  return 0;
}
