// A world in the caller's own program: it answers the wire's requests without a server.
#pragma once

#include <cstddef>
#include <memory>

#include "app/live_world.h"
#include "base/status.h"
#include "physics/machine/workers.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// It is paused, as it were: time goes on by Step and StepUntil. Not thread-safe.
class LocalWorld {
 public:
  /// `threads` counts the caller.
  [[nodiscard]] static base::Result<LocalWorld> create(v1::Scene scene, std::size_t threads);

  /// The reply of a server's world to Step, StepUntil, GetScene, GetStats, questions (world_queries.h) and what
  /// LiveWorld changes by.
  /// Other requests are UNSUPPORTED. Stats have what the physics tells. The world is called by its scene's name;
  /// requests may leave it out.
  [[nodiscard]] v1::ServerMessage answer(const v1::ClientMessage& request);

  [[nodiscard]] const LiveWorld& live() const { return live_; }

 private:
  LocalWorld(LiveWorld live, std::size_t threads);
  [[nodiscard]] base::Result<v1::ServerMessage> try_to_answer(const v1::ClientMessage& request);
  [[nodiscard]] base::Result<v1::ServerMessage> step(const v1::ClientMessage& request);
  [[nodiscard]] base::Result<v1::ServerMessage> change(const v1::ClientMessage& request);

  LiveWorld live_;
  std::unique_ptr<physics::Workers> workers_;
};

}  // namespace pneuma::app
