// The same header from C++: a stone falls on a sheet that is pinned at its corners, until they touch.
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>

#include <pneuma.h>

namespace {

constexpr const char* scene = R"({
  "name": "trampoline",
  "gravity": {"y": -9.81},
  "meshes": [{"name": "sheet", "grid": {"columns": 12, "rows": 12, "width_m": 2, "height_m": 2}}],
  "soft_bodies": [{"name": "sheet", "mesh": "sheet", "mass_kg": 1,
                   "springs": {"stiffness_n_m": 2000, "damping_n_s_m": 1}, "pins": [0, 12, 156, 168]}],
  "rigid_bodies": [{"name": "stone", "shape": {"sphere": {"radius_m": 0.2}}, "position": {"y": 1}, "mass_kg": 1}]
})";

struct Destroy {
  void operator()(pneuma_world* world) const { pneuma_world_destroy(world); }
};

}  // namespace

int main() {
  pneuma_error error;
  const std::unique_ptr<pneuma_world, Destroy> world(pneuma_world_create(scene, 2, &error));
  char* reply = nullptr;
  const char* until = R"({"step_until": {"ticks_max": 300, "touch": {"first": "stone", "second": "sheet"}}})";
  if (!world || pneuma_world_request(world.get(), until, &reply, &error) != PNEUMA_OK) {
    std::cerr << "tumble: " << error.where << ' ' << error.what << '\n';
    return EXIT_FAILURE;
  }
  std::cout << reply << '\n';
  pneuma_text_free(reply);
  const pneuma_frame* frame = pneuma_world_frame(world.get());
  std::cout << "the stone is down at " << frame->time_s << " s, " << frame->solids[0].position_m[1] << " m up\n";
}
