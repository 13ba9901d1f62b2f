// What one world holds of the server's memory: by estimate, and asked for before it is built.
#pragma once

#include <cstddef>

#include "app/world_bytes.h"
#include "base/memory_budget.h"
#include "base/status.h"
#include "physics/scene/scene.h"
#include "pneuma/v1/scene.pb.h"

namespace pneuma::app {

class WorldMemory {
 public:
  /// What a world may take of what, at most.
  struct Limits {
    base::MemoryBudget budget;  // of whoever made the world, a part of the server's
    std::size_t world_bytes_max;
  };
  /// For who has no limits.
  [[nodiscard]] static WorldMemory unlimited();
  explicit WorldMemory(Limits limits) : limits_(std::move(limits)), share_(limits_.budget.take_anyway(0)) {}

  /// Makes room for the world as a new scene has it, beside its streams. Refused with the numbers.
  [[nodiscard]] base::Status admit(const v1::Scene& source, const physics::Scene& scene);
  /// The same of a world that is there already: past any limit.
  void take_over(const v1::Scene& source, const physics::Scene& scene);
  /// Makes room for another stream of every vertex.
  [[nodiscard]] base::Status admit_stream(double bytes_per_vertex);

  /// What was admitted has come to be, or not: room that it does not need is given back. `bytes_per_vertex` is that of
  /// all streams.
  void settle(bool admitted_scene_holds, physics::Integrator integrator, double stream_bytes_per_vertex);

  [[nodiscard]] std::size_t bytes() const { return share_.bytes(); }

 private:
  [[nodiscard]] base::Status grow_to(std::size_t bytes);
  [[nodiscard]] std::size_t stream_bytes(std::size_t vertices) const;

  Limits limits_;
  WorldEstimates estimates_;
  WorldBytes scene_;
  WorldBytes admitted_;
  double stream_bytes_per_vertex_ = 0.0;
  base::MemoryBudget::Share share_;
};

}  // namespace pneuma::app
