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
    std::string name;
    TopologyMessagePtr topology;
    std::optional<codec::Mechanics> mechanics{};  // where they are told
  };
  enum class Update {
    none,     // as it was, and current
    waits,    // for a topology; until it is there, the layout is of what was
    renewed,  // current again, and says the same
    changed,  // current, with a new id
  };

  /// The frames of a stream whose layout tells mechanics.
  struct Simulated {
    std::uint64_t ticks = 0;  // from one frame to the next; 0: none are told
    double grid_step_m = 0.0;
  };

  WorldLayout(View view, Simulated simulated) : view_(std::move(view)), simulated_(simulated) {}

  /// What is shown was edited.
  void edited() {
    current_ = false;
    mechanics_current_ = false;
  }
  /// Frames come at another distance from now on.
  void set_frame_ticks(std::uint64_t ticks) {
    simulated_.ticks = ticks;
    mechanics_current_ = false;
  }
  /// The bodies are what they were, but move otherwise.
  void mechanics_changed() { mechanics_current_ = false; }
  /// Takes the world's bodies as they are now where they were edited; their mechanics once a simulated second at most:
  /// until then they are those that were told, or none.
  [[nodiscard]] Update update(const FrameSource& source, MeshTopologies& topologies, std::uint64_t tick);

  [[nodiscard]] std::uint32_t id() const { return layout_.layout_id(); }
  /// Each once.
  [[nodiscard]] std::vector<TopologyMessagePtr> topologies() const;
  [[nodiscard]] const std::vector<Body>& bodies() const { return bodies_; }
  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] v1::ServerMessage message(std::uint32_t stream_id) const;

 private:
  [[nodiscard]] bool find_bodies(const FrameSource& source, MeshTopologies& topologies);
  [[nodiscard]] bool looks_at_mechanics(const FrameSource& source, std::uint64_t tick) const;
  void find_mechanics(const FrameSource& source);
  [[nodiscard]] v1::Layout describe(const FrameSource& source) const;
  void keep_joints_of_shown(v1::Layout& layout) const;

  View view_;
  Simulated simulated_;
  bool current_ = false;
  bool mechanics_current_ = false;
  std::optional<std::uint64_t> mechanics_tick_;  // when they were looked at
  v1::Layout layout_;
  std::vector<Body> bodies_;
};

}  // namespace pneuma::app
