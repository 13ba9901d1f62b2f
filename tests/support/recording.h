// Built-in scenes as they move: what a subscriber of every tick would see.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "codec/frame_codec.h"
#include "physics/world.h"
#include "scene_io/load.h"
#include "scene_io/set_path.h"
#include "scene_io/translate.h"

namespace pneuma::support {

/// A world's soft bodies, tick by tick.
struct Recording {
  std::vector<std::shared_ptr<const physics::Mesh>> meshes;  // one a body
  std::vector<codec::MeshOrderPtr> orders;                   // likewise
  std::vector<std::vector<std::vector<double>>> frames_m;    // by tick and body: three a vertex

  [[nodiscard]] std::size_t vertex_count() const {
    std::size_t count = 0;
    for (const auto& order : orders) count += order->size();
    return count;
  }
};

/// The world of a built-in scene with these fields set (scene_io/set_path.h). Throws std::runtime_error with the reason
/// where it does not come to be.
inline physics::World world_of(const std::string& scene_name, const std::vector<std::string>& assignments = {}) {
  const auto check = [](const base::Status& status) {
    if (!status.ok()) throw std::runtime_error(status.message());
  };
  auto scene = scene_io::builtin_scene(scene_name);
  check(scene.status());
  for (const std::string& assignment : assignments) check(scene_io::set_path(*scene, assignment));
  const auto meshes = scene_io::MeshLibrary::build(*scene);
  check(meshes.status());
  auto built = scene_io::to_physics(*scene, *meshes);
  check(built.status());
  auto world = physics::World::create(std::move(*built));
  check(world.status());
  return std::move(*world);
}

inline std::span<const std::uint32_t> indices_of(const physics::Mesh& mesh) {
  return {mesh.faces.front().data(), 3 * mesh.faces.size()};
}
inline codec::MeshOrderPtr order_of(const physics::Mesh& mesh) {
  return std::make_shared<const codec::MeshOrder>(
      codec::make_mesh_order(static_cast<std::uint32_t>(mesh.positions_m.size()), indices_of(mesh)));
}

inline Recording record(physics::World world, std::size_t ticks) {
  Recording recording;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    recording.meshes.push_back(world.soft_body(i).mesh);
    recording.orders.push_back(order_of(*recording.meshes.back()));
  }
  physics::Workers one_thread(1);
  for (std::size_t tick = 0; tick <= ticks; ++tick) {
    if (tick > 0) world.step_tick(one_thread);
    auto& frame_m = recording.frames_m.emplace_back(recording.orders.size());
    for (std::size_t i = 0; i < frame_m.size(); ++i) {
      frame_m[i].resize(3 * recording.orders[i]->size());
      world.copy_positions(i, frame_m[i]);
    }
  }
  return recording;
}

/// Of the bodies that have mechanics; none given: of no body.
inline std::vector<codec::SimulatedMotionPtr> simulations_of(
    const Recording& recording, const std::vector<std::optional<codec::Mechanics>>& mechanics, double grid_step_m) {
  std::vector<codec::SimulatedMotionPtr> simulations(mechanics.size());
  for (std::size_t i = 0; i < mechanics.size(); ++i) {
    if (!mechanics[i]) continue;
    simulations[i] = std::make_shared<codec::SimulatedMotion>(recording.orders[i], indices_of(*recording.meshes[i]),
                                                              *mechanics[i], grid_step_m);
  }
  return simulations;
}

/// How far the last frame read, of this tick, puts the worst vertex from where it was.
inline double furthest_m(const Recording& recording, std::size_t tick, const codec::FrameReader& reader,
                         double step_m) {
  double furthest_m = 0.0;
  for (std::size_t body = 0; body < recording.orders.size(); ++body) {
    const std::vector<double>& true_m = recording.frames_m[tick][body];
    std::vector<double> read_m(true_m.size());
    reader.positions(body, step_m, read_m);
    for (std::size_t i = 0; i < true_m.size(); i += 3) {
      furthest_m = std::max(
          furthest_m, std::hypot(read_m[i] - true_m[i], read_m[i + 1] - true_m[i + 1], read_m[i + 2] - true_m[i + 2]));
    }
  }
  return furthest_m;
}

}  // namespace pneuma::support
