// What a subscriber must know before it can read a stream's frames: its bodies' topologies and their order.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/frame_source.h"
#include "app/mesh_topologies.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// What of a world a stream shows.
struct View {
  std::vector<std::string> bodies;  // the soft bodies of these names, sorted; none: all
  std::uint32_t level = 0;          // of detail
  auto operator<=>(const View&) const = default;

  [[nodiscard]] bool shows(const std::string& body) const;
};

/// The layout of a stream, and the topologies that it names.
class WorldLayout {
 public:
  /// A soft body of the layout.
  struct Body {
    std::size_t index;  // in the source
    TopologyMessagePtr topology;
    std::optional<codec::Mechanics> mechanics{};  // where they are told
  };
  enum class Update {
    none,     // as it was, and current
    waits,    // for a topology; until it is there, the layout is of what was
    renewed,  // current again, and says the same
    changed,  // current, with a new id
  };

  /// `simulated_ticks`: from one frame to the next, where the bodies' mechanics are told; 0: they are not.
  explicit WorldLayout(View view, std::uint64_t simulated_ticks = 0)
      : view_(std::move(view)), simulated_ticks_(simulated_ticks) {}

  /// What is shown was edited.
  void edited() { current_ = false; }
  /// Takes the world's bodies as they are now where they were edited.
  [[nodiscard]] Update update(const FrameSource& source, MeshTopologies& topologies);

  [[nodiscard]] std::uint32_t id() const { return layout_.layout_id(); }
  /// Each once.
  [[nodiscard]] std::vector<TopologyMessagePtr> topologies() const;
  [[nodiscard]] const std::vector<Body>& bodies() const { return bodies_; }
  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] v1::ServerMessage message(std::uint32_t stream_id) const;

 private:
  [[nodiscard]] bool find_bodies(const FrameSource& source, MeshTopologies& topologies);
  void find_mechanics(const FrameSource& source);

  View view_;
  std::uint64_t simulated_ticks_;
  bool current_ = false;
  v1::Layout layout_;
  std::vector<Body> bodies_;
};

}  // namespace pneuma::app
