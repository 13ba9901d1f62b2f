// Many worlds of one scene, for programs that learn from them: stepped on all cores, acted on and seen as arrays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "physics/machine/workers.h"
#include "physics/world.h"
#include "physics/world_batch.h"

namespace pneuma::physics {

/// What is done to the worlds before a step: one row a world. What is empty is not done.
/// A row has so many columns: bodies are the soft ones and then the rigid ones, in the scene's order.
struct FleetActions {
  std::span<const double> impulses_n_s;                       // bodies x 3, each to a whole body
  std::span<const double> moles;                              // soft bodies; NaN leaves one as it is
  std::span<const double> collider_velocities_m_s;            // colliders x 3; NaN leaves a collider as it is
  std::span<const double> collider_angular_velocities_rad_s;  // likewise
};

/// Where what the worlds show is written: one row a world. What is empty is not wanted.
struct FleetView {
  std::span<float> positions_m;           // vertices of all soft bodies x 3
  std::span<float> velocities_m_s;        // likewise
  std::span<double> centres_of_mass_m;    // bodies x 3
  std::span<double> mean_velocities_m_s;  // bodies x 3: momentum over mass
  std::span<double> pressures_pa;         // soft bodies: of the gas, over the outside
  std::span<double> volumes_m3;           // soft bodies
  std::span<bool> frozen;                 // bodies
  std::span<std::uint64_t> ticks;         // 1
};

/// Not thread-safe. Each world has the same bits as one that is stepped and changed by itself.
class Fleet {
 public:
  /// All at tick 0. `threads` counts the caller.
  [[nodiscard]] static base::Result<Fleet> create(Scene scene, std::size_t count, std::size_t threads);

  [[nodiscard]] std::size_t count() const { return worlds_.size(); }
  [[nodiscard]] const World& world(std::size_t index) const { return worlds_[index]; }
  [[nodiscard]] std::size_t vertex_count() const { return vertex_count_; }
  [[nodiscard]] std::size_t body_count() const { return body_names_.size(); }
  [[nodiscard]] const std::vector<std::string>& body_names() const { return body_names_; }

  /// Acts on every world, steps it, and shows it. Refuses what an edit or an impulse would refuse, moles of a body that
  /// the scene gives no gas, and a velocity that is NaN in part. A body that is frozen takes no impulse, and one whose
  /// gas burst takes no moles. Errors name the world; other worlds may have been stepped then.
  [[nodiscard]] base::Status step(std::uint32_t ticks, const FleetActions& actions, const FleetView& view);
  /// Puts the worlds whose element is not 0 back to the scene's start, and shows all. `which` has one element a world.
  void reset(std::span<const std::uint8_t> which, const FleetView& view);

 private:
  Fleet(World start, std::size_t count, std::size_t threads);

  [[nodiscard]] base::Status act(std::size_t index, const FleetActions& actions);
  [[nodiscard]] base::Status push(std::size_t index, const FleetActions& actions);
  [[nodiscard]] base::Status change(std::size_t index, const FleetActions& actions);
  void show(std::size_t index, const FleetView& view) const;
  void show_vertices(std::size_t index, const FleetView& view) const;
  void show_bodies(std::size_t index, const FleetView& view) const;

  World start_;
  std::vector<World> worlds_;
  std::unique_ptr<Workers> threads_;
  std::vector<WorldBatch> batches_;  // one a thread
  std::vector<std::string> body_names_;
  std::size_t vertex_count_ = 0;
};

}  // namespace pneuma::physics
