// Worlds that go through a tick together, so that bodies of several of them fill the lanes side by side.
#pragma once

#include <memory>
#include <span>

#include "physics/world.h"

namespace pneuma::physics {

/// Room for the bodies under way: one a thread.
class Company {
 public:
  Company();
  ~Company();
  Company(Company&&) noexcept;
  Company& operator=(Company&&) noexcept;

  /// Readies a world, and the copies made of it from now on: makes the tables that its bodies need beside others.
  static void prepare(World& world);
  /// Steps each world by a tick, to the bits that World::step_tick gives. Bodies of different worlds share lanes where
  /// their worlds hold nothing to touch, the bodies are alike (StepGroup), and the same acts on them.
  void step_tick(std::span<World* const> worlds);

 private:
  struct Room;
  std::unique_ptr<Room> room_;
};

}  // namespace pneuma::physics
