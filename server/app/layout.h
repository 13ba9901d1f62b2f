// What a subscriber must know before it can read a world's frames: its bodies' topologies and their order.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "app/frame_source.h"
#include "codec/frame_codec.h"
#include "net/server.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// A mesh's topology, named and ready to be sent.
struct TopologyMessage {
  std::string hash;
  codec::MeshOrderPtr order;  // of its vertices in the frames
  net::SharedBytes message;
};

/// The layout of a world, and the topologies that it names. Meshes that stay over a change are not hashed again.
class WorldLayout {
 public:
  /// Takes the world's bodies as they are now. True where that changed the layout, which then has a new id.
  bool update(const FrameSource& source);

  [[nodiscard]] std::uint32_t id() const { return layout_.layout_id(); }
  /// One a mesh in use.
  [[nodiscard]] std::vector<TopologyMessage> topologies() const;
  /// One a soft body.
  [[nodiscard]] const std::vector<codec::MeshOrderPtr>& orders() const { return orders_; }
  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] v1::ServerMessage message(std::uint32_t stream_id) const;

 private:
  v1::Layout layout_;
  std::map<std::shared_ptr<const physics::Mesh>, TopologyMessage> topologies_;
  std::vector<codec::MeshOrderPtr> orders_;
};

}  // namespace pneuma::app
