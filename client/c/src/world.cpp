// Worlds in the caller's program.
#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/local_world.h"
#include "app/scene_source.h"
#include "failure.h"
#include "frame_view.h"
#include "pneuma.h"
#include "requests.h"

struct pneuma_world {
  pneuma::app::LocalWorld local;
  pneuma::c::FrameView view = {};
};

namespace pneuma::c {

namespace {

// As pneuma-sim's.
constexpr std::uint32_t threads_max = 256;

base::Status no_world() {
  return base::invalid("is NULL", "world");
}

base::Result<app::LocalWorld> create(const char* scene, std::uint32_t threads) {
  if (scene == nullptr) return base::invalid("is NULL", "scene");
  if (threads > threads_max) {
    return base::invalid("are too many; 256 are the most", "threads");
  }
  const std::string text(scene);
  const bool is_json = text.find('{') != std::string::npos;
  v1::CreateWorld request;
  (is_json ? request.mutable_scene_json() : request.mutable_builtin())->assign(text);
  auto made = app::scene_of(request);
  if (!made.ok() && !is_json) {
    return base::Status(made.status().code(),
                        made.status().what() + " (the text of a scene's file is taken, not its path)", "scene");
  }
  if (!made.ok()) return made.status();
  return app::LocalWorld::create(std::move(*made), std::max<std::uint32_t>(threads, 1));
}

void look_at(const app::LiveWorld& live, FrameView& view) {
  const physics::World& world = live.physics();
  view.begin(live.scene_name(), live.tick(), world.time_s());
  std::vector<double> positions_m;
  std::vector<double> velocities_m_s;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    const physics::SoftBody& body = world.soft_body(i);
    positions_m.resize(3 * body.mesh->positions_m.size());
    velocities_m_s.resize(positions_m.size());
    world.copy_positions(i, positions_m);
    world.copy_velocities(i, velocities_m_s);
    view.add_soft_body(body.name, positions_m, velocities_m_s,
                       {body.mesh->faces.front().data(), 3 * body.mesh->faces.size()});
  }
  for (const physics::RigidState& state : world.rigid_bodies()) {
    view.add_solid(state.body.name, true, state.position, state.orientation);
  }
  for (const physics::ColliderState& state : world.colliders()) {
    view.add_solid(state.collider.name, false, state.position, state.orientation);
  }
}

}  // namespace

}  // namespace pneuma::c

extern "C" {

uint32_t pneuma_api_version(void) {
  return PNEUMA_API_VERSION;
}

pneuma_world* pneuma_world_create(const char* scene, uint32_t threads, pneuma_error* error) {
  pneuma_world* world = nullptr;
  pneuma::c::guarded(error, [&]() -> pneuma::base::Status {
    auto made = pneuma::c::create(scene, threads);
    if (!made.ok()) return made.status();
    world = new pneuma_world{std::move(*made)};
    return {};
  });
  return world;
}

void pneuma_world_destroy(pneuma_world* world) {
  delete world;
}

pneuma_code pneuma_world_step(pneuma_world* world, uint32_t ticks, pneuma_error* error) {
  return pneuma::c::guarded(error, [&]() -> pneuma::base::Status {
    if (world == nullptr) return pneuma::c::no_world();
    pneuma::v1::ClientMessage request;
    request.mutable_step()->set_ticks(ticks);
    return pneuma::c::tell_reply(world->local.answer(request), nullptr);
  });
}

const pneuma_frame* pneuma_world_frame(pneuma_world* world) {
  const pneuma_frame* frame = nullptr;
  pneuma::c::guarded(nullptr, [&]() -> pneuma::base::Status {
    if (world == nullptr) return pneuma::c::no_world();
    pneuma::c::look_at(world->local.live(), world->view);
    frame = world->view.frame();
    return {};
  });
  return frame;
}

uint64_t pneuma_world_state_hash(const pneuma_world* world) {
  return world == nullptr ? 0 : world->local.live().physics().state_hash();
}

pneuma_code pneuma_world_request(pneuma_world* world, const char* request, char** reply, pneuma_error* error) {
  return pneuma::c::guarded(error, [&]() -> pneuma::base::Status {
    if (world == nullptr) return pneuma::c::no_world();
    const auto asked = pneuma::c::parse_request(request);
    if (!asked.ok()) return asked.status();
    return pneuma::c::tell_reply(world->local.answer(*asked), reply);
  });
}

}  // extern "C"
