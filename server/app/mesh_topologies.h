// The topologies that a world's streams name: those of its meshes, and of their coarser versions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "codec/frame_codec.h"
#include "net/server.h"
#include "physics/mesh/mesh.h"

namespace pneuma::app {

/// A topology, named and ready to be sent.
struct TopologyMessage {
  std::string hash;
  codec::MeshOrderPtr order;  // of its vertices in the frames
  net::SharedBytes message;
  std::vector<std::uint32_t> kept;  // which of the mesh's vertices its own are, ascending; empty at level 0: all
};
using TopologyMessagePtr = std::shared_ptr<const TopologyMessage>;

/// Each is made once for as long as someone holds it. Coarser versions may take long, so they are made apart.
class MeshTopologies {
 public:
  /// Carries `make` out, now or on another thread; then sees to it that the world asks again. `make` makes one mesh, a
  /// coarser one of so many vertices, and does not throw.
  using Defer = std::function<void(std::size_t vertices, std::function<void()> make)>;
  explicit MeshTopologies(Defer defer);

  /// Null where it is yet to be made.
  [[nodiscard]] TopologyMessagePtr find(const std::shared_ptr<const physics::Mesh>& mesh, std::uint32_t level);
  /// Has those made that were not found, one after another: at most one is under way, and the next is begun when the
  /// world asks again. So the worlds take turns, and none is begun that nobody waits for any more.
  void make_missing();
  /// Ends a round of asking: forgets those that nobody holds or asked for, and what was asked for.
  void drop_unused();

 private:
  using Key = std::pair<std::shared_ptr<const physics::Mesh>, std::uint32_t>;
  struct Workshop;

  [[nodiscard]] bool collect();

  Defer defer_;
  std::map<Key, TopologyMessagePtr> found_;
  std::vector<Key> missing_;            // asked for in this round, and not found then
  std::shared_ptr<Workshop> workshop_;  // shared with the job under way, which may outlive the world
};

}  // namespace pneuma::app
