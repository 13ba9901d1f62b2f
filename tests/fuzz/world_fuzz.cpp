// No saved world may crash the server that is given it, nor the world that it becomes: whoever made the file is not
// trusted, and can give it the right checksums.
// Input: a byte for the scene, a byte for the ticks that its world has done, then places and values: numbers of 8 bytes
// that are written over a good state of it.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "app/saved_world.h"
#include "app/world_file.h"
#include "scene_io/json.h"

using namespace pneuma;

namespace {

constexpr std::array scenes{
    R"({"name": "a", "gravity": {"y": -9.81}, "meshes": [{"name": "m", "icosphere": {}}],
        "soft_bodies": [{"name": "b", "mesh": "m", "position": {"y": 1.05}, "gas": {"moles": 0.02}},
                        {"name": "c", "mesh": "m", "position": {"y": 3}, "gas": {"moles": 0.02}}],
        "colliders": [{"name": "f", "shape": {"plane": {}}}],
        "joints": [{"name": "j", "first": {"soft_body": "b", "vertex": 0}, "second": {"point": {"y": 2}},
                    "distance_limit": {"longest_m": 1}}]})",
    R"({"name": "a", "gravity": {"y": -9.81}, "stepping": {"integrator": "IMPLICIT_EULER", "substeps": 1},
        "meshes": [{"name": "m", "icosphere": {}}],
        "soft_bodies": [{"name": "b", "mesh": "m", "position": {"y": 1.05}, "gas": {"moles": 0.02}}],
        "rigid_bodies": [{"name": "r", "shape": {"box": {"half_extents": {"x": 1, "y": 0.1, "z": 1}}},
                          "position": {"y": 2.2}}],
        "colliders": [{"name": "f", "shape": {"plane": {}}}]})",
    R"({"name": "a", "gravity": {"y": -9.81}, "stepping": {"integrator": "XPBD"},
        "meshes": [{"name": "m", "icosphere": {}}],
        "soft_bodies": [{"name": "b", "mesh": "m", "position": {"y": 1.05}, "gas": {"moles": 0.02}}],
        "rigid_bodies": [{"name": "r", "shape": {"sphere": {"radius_m": 0.3}}, "position": {"x": 2, "y": 0.3}},
                         {"name": "s", "shape": {"sphere": {"radius_m": 0.3}}, "position": {"x": 2, "y": 0.9}}],
        "colliders": [{"name": "f", "shape": {"plane": {}}}]})",
};
constexpr std::size_t ticks_max = 4;

void step(app::LiveWorld& live, std::size_t ticks) {
  physics::Workers workers(1);
  for (std::size_t i = 0; i < ticks; ++i) live.physics().step_tick(workers);
}

/// What a server would have saved: one a scene and a number of ticks.
std::vector<app::LiveWorld::Saved> good_worlds() {
  std::vector<app::LiveWorld::Saved> worlds;
  for (const char* json : scenes) {
    const auto scene = scene_io::parse_scene_json(json);
    if (!scene.ok()) std::abort();
    auto live = app::LiveWorld::create(*scene);
    if (!live.ok()) std::abort();
    for (std::size_t ticks = 0; ticks < ticks_max; ++ticks, step(*live, 1)) worlds.push_back(live->save());
  }
  return worlds;
}

/// Bytes as they are, or a number that programs stumble over.
std::uint64_t value_of(const std::uint8_t* bytes) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  constexpr std::array numbers{std::numeric_limits<double>::quiet_NaN(),
                               infinity,
                               -infinity,
                               1e308,
                               -1e308,
                               1e-320,
                               -0.0,
                               1e12,
                               -1e12,
                               1.0,
                               -1.0};
  std::uint64_t raw = 0;
  std::memcpy(&raw, bytes, sizeof(raw));
  if (bytes[0] >= numbers.size()) return raw;
  std::memcpy(&raw, &numbers[bytes[0]], sizeof(raw));
  return raw;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const std::vector<app::LiveWorld::Saved> worlds = good_worlds();
  if (size < 2) return 0;
  app::SavedWorld saved{worlds[bytes[0] % scenes.size() * ticks_max + bytes[1] % ticks_max], false};
  std::string& state = saved.live.snapshot;
  constexpr std::size_t record = sizeof(std::uint16_t) + sizeof(std::uint64_t);
  for (std::size_t at = 2; at + record <= size; at += record) {
    const std::size_t place = (bytes[at] | std::size_t{bytes[at + 1]} << 8U) % state.size();
    const std::uint64_t value = value_of(bytes + at + sizeof(std::uint16_t));
    std::memcpy(state.data() + place, &value, std::min(sizeof(value), state.size() - place));
  }
  v1::WorldFile file;
  file.set_earlier_tick(saved.live.tick);
  file.set_earlier_state(to_bytes(saved));
  auto opened = app::open_history(file);
  if (!opened.ok()) {
    if (opened.status().message().empty()) std::abort();
    return 0;
  }
  step(opened->live, 2);
  (void)opened->live.save();
  return 0;
}
