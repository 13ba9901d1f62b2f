// What a subscriber gets: decoded frames, and the state that decoding keeps from frame to frame. No sockets here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/status.h"
#include "codec/frame_codec.h"
#include "pneuma/v1/frame.pb.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::client {

/// The triangles of a mesh; shared by all bodies, streams and connections that use them.
struct Topology {
  std::string hash;  // 16 bytes
  std::uint32_t vertex_count = 0;
  std::vector<std::uint32_t> indices;  // three a face
};
using TopologyPtr = std::shared_ptr<const Topology>;

struct BodyScalars {
  double volume_m3 = 0.0;    // 0 of an open skin
  double pressure_pa = 0.0;  // of the gas, over the outside
  double kinetic_j = 0.0;
  double elastic_j = 0.0;
  bool asleep = false;
};

struct SoftBodyFrame {
  std::string name;
  TopologyPtr topology;
  // With a level of detail: which of the mesh's vertices these are, ascending; otherwise empty. Never null.
  std::shared_ptr<const std::vector<std::uint32_t>> kept_vertices;
  std::vector<double> positions_m;     // x y z a vertex
  std::vector<double> velocities_m_s;  // likewise; empty where the stream has none
  BodyScalars scalars;                 // zeros where the stream has none
};

struct SolidFrame {
  std::string name;
  bool dynamic = false;  // a rigid body; otherwise a collider
  v1::Shape shape;
  v1::Vec3 position;
  v1::Quaternion orientation;
  std::shared_ptr<const v1::Mesh::Triangles> surface;  // of a shape that names a mesh, in its own frame; else null
};

/// A vertex that was held off something in the last substep of the frame's tick.
struct ContactFrame {
  std::size_t body = 0;                      // in DecodedFrame::bodies
  std::uint32_t vertex = 0;                  // of the whole mesh, whatever the level of detail
  std::optional<std::size_t> other_body{};   // likewise; neither: a soft body that the stream does not hold
  std::optional<std::size_t> other_solid{};  // in DecodedFrame::solids
  std::array<double, 3> normal{};            // unit, out of the other
};

/// A whole world at one tick, as a stream sees it.
struct DecodedFrame {
  std::uint32_t stream_id = 0;
  std::string world;
  std::uint64_t tick = 0;
  double time_s = 0.0;  // simulated
  bool key = false;
  std::uint32_t layer = 0;  // with SubscribeOptions::time_layers: 0, 1 or 2
  std::size_t bytes = 0;    // that the frame took on the wire, framing included
  bool has_velocities = false;
  bool has_scalars = false;
  std::vector<SoftBodyFrame> bodies;
  std::vector<SolidFrame> solids;
  std::vector<ContactFrame> contacts;  // with SubscribeOptions::contacts
  // Those of the layout, which count bodies and solids as above; never null.
  std::shared_ptr<const std::vector<v1::Layout::Joint>> joints;
};

/// Turns the messages of all streams of a connection into frames. Any message that does not fit, or is past the limits
/// of base/limits.h, gives an error and changes nothing, but that a stream whose places or velocities cannot be, or are
/// not the server's, waits for a key frame.
class StreamDecoder {
 public:
  /// Takes the topologies held from an earlier connection.
  explicit StreamDecoder(const std::vector<TopologyPtr>& known = {});

  [[nodiscard]] base::Status add_stream(const v1::Subscribed& subscribed);
  void remove_stream(std::uint32_t stream_id);
  [[nodiscard]] bool has_stream(std::uint32_t stream_id) const { return streams_.contains(stream_id); }

  [[nodiscard]] base::Status take_topology(const v1::Topology& message);
  /// Of a stream that is not there (it was ended a moment ago): ignored.
  [[nodiscard]] base::Status take_layout(const v1::Layout& message);
  /// `bytes` is the size on the wire, handed through. Nothing where the stream is not there, and of a delta frame where
  /// the stream waits for a key.
  [[nodiscard]] base::Result<std::optional<DecodedFrame>> take_frame(const v1::Frame& message, std::size_t bytes);
  /// Whether a delta frame has failed its check, and no key frame came since. One is to be asked for.
  [[nodiscard]] bool waits_for_key(std::uint32_t stream_id) const;

  [[nodiscard]] std::vector<TopologyPtr> topologies() const;

 private:
  struct Body {
    std::string name;
    TopologyPtr topology;
    std::shared_ptr<const std::vector<std::uint32_t>> kept_vertices;
  };
  /// What a frame leaves behind.
  struct State {
    std::optional<std::uint64_t> tick;  // none: there was no frame yet
    double time_s = 0.0;
    codec::FrameReader reader;
    codec::FrameReader velocity_reader;
    std::vector<SolidFrame> solids;
  };
  struct Stream {
    std::string world;
    double grid_step_m = 0.0;
    double velocity_grid_step_m_s = 0.0;  // 0: no velocities
    double tick_s = 0.0;
    std::optional<std::uint32_t> layout_id;
    bool waits_for_key = false;
    std::vector<Body> bodies;
    std::shared_ptr<const std::vector<v1::Layout::Joint>> joints;
    // After the last frame of layer 0, after the one of layer 1, and after any of layer 2.
    std::array<State, 3> layers;
  };

  /// Of the vertices in frames. It is made for as long as a stream holds it: most of what a mesh without triangles
  /// takes, of which a server may send any number.
  [[nodiscard]] codec::MeshOrderPtr order_of(const Topology& topology);
  [[nodiscard]] static base::Status check_frame(const Stream& stream, const v1::Frame& message);
  [[nodiscard]] static base::Status check_contacts(const Stream& stream, const v1::Frame& message);
  [[nodiscard]] static const State* base_of(const Stream& stream, const v1::Frame& message);
  [[nodiscard]] static base::Status read_vectors(const Stream& stream, State& state, const v1::Frame& message);
  [[nodiscard]] static base::Status verify(const Stream& stream, const State& state, const v1::Frame& message);
  [[nodiscard]] static base::Status fill_bodies(const Stream& stream, const State& state, const v1::Frame& message,
                                                DecodedFrame& frame);

  std::map<std::string, TopologyPtr> topologies_;                        // by hash
  std::map<std::string, std::weak_ptr<const codec::MeshOrder>> orders_;  // likewise
  std::map<std::uint32_t, Stream> streams_;                              // by id
};

}  // namespace pneuma::client
