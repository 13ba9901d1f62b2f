#include "app/world_memory.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "base/number_text.h"

namespace pneuma::app {

namespace {

std::string mebibytes(std::size_t bytes) {
  constexpr std::size_t mebibyte = 1024 * 1024;
  return std::to_string((bytes + mebibyte - 1) / mebibyte) + " MiB";
}

}  // namespace

WorldMemory WorldMemory::unlimited() {
  constexpr std::size_t most = std::numeric_limits<std::size_t>::max() / 2;
  return WorldMemory({base::MemoryBudget(most), most});
}

std::size_t WorldMemory::stream_bytes(std::size_t vertices) const {
  return static_cast<std::size_t>(stream_bytes_per_vertex_ * static_cast<double>(vertices));
}

base::Status WorldMemory::admit(const v1::Scene& source, const physics::Scene& scene) {
  auto estimate = estimates_.of(source, scene);
  if (!estimate.ok()) return estimate.status();
  const std::size_t wanted = estimate->by(scene.stepping.integrator) + stream_bytes(estimate->vertices);
  if (base::Status no_room = grow_to(wanted); !no_room.ok()) return no_room;
  admitted_ = *estimate;
  return {};
}

void WorldMemory::take_over(const v1::Scene& source, const physics::Scene& scene) {
  const auto estimate = estimates_.of(source, scene);
  if (!estimate.ok()) return;  // it runs as it did before there was such a limit
  admitted_ = *estimate;
  share_ = limits_.budget.take_anyway(estimate->by(scene.stepping.integrator));
}

base::Status WorldMemory::admit_stream(double bytes_per_vertex) {
  const auto more = static_cast<std::size_t>(bytes_per_vertex * static_cast<double>(scene_.vertices));
  return grow_to(share_.bytes() + more);
}

base::Status WorldMemory::grow_to(std::size_t bytes) {
  const std::string takes = "the world would take " + mebibytes(bytes) + " of memory";
  if (bytes > limits_.world_bytes_max) {
    return {base::StatusCode::limit_exceeded, takes + ", and a world may take " + mebibytes(limits_.world_bytes_max)};
  }
  if (share_.grow_to(bytes)) return {};
  const std::size_t left = limits_.budget.bytes_left();
  const bool is_own = limits_.budget.bytes_left_of_its_own() == left;
  return {
      is_own ? base::StatusCode::limit_exceeded : base::StatusCode::unavailable,
      takes + ", and " + mebibytes(left) + (is_own ? " are left of what you may take" : " are left of the server's")};
}

void WorldMemory::settle(bool admitted_scene_holds, physics::Integrator integrator, double stream_bytes_per_vertex) {
  if (admitted_scene_holds) scene_ = admitted_;
  stream_bytes_per_vertex_ = stream_bytes_per_vertex;
  const std::size_t bytes = scene_.by(integrator) + stream_bytes(scene_.vertices);
  if (bytes < share_.bytes()) {
    share_.shrink_to(bytes);
  } else if (!share_.grow_to(bytes)) {  // what is there already
    share_ = limits_.budget.take_anyway(bytes);
  }
}

}  // namespace pneuma::app
