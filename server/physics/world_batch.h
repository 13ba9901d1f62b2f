// Worlds that are stepped together, so that bodies of several of them fill the lanes side by side.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "physics/world.h"

namespace pneuma::physics {

/// Steps worlds together. It holds scratch alone; one a thread.
class WorldBatch {
 public:
  WorldBatch();
  ~WorldBatch();
  WorldBatch(WorldBatch&&) noexcept;
  WorldBatch& operator=(WorldBatch&&) noexcept;

  /// Readies a world, and the copies made of it from now on: makes the tables that its bodies need beside those of
  /// other worlds.
  static void prepare(World& world);
  /// Steps each world, named once, by a tick: to the bits that World::step_tick gives. Bodies of different worlds share
  /// lanes where their worlds hold nothing to touch, the bodies are alike (StepGroup), and the same acts on them.
  /// Returns how many bodies did.
  std::size_t step_tick(std::span<World* const> worlds);

 private:
  struct Scratch;
  std::unique_ptr<Scratch> scratch_;
};

}  // namespace pneuma::physics
