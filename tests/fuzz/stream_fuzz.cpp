// No frame messages from a server may crash a client or leave a stream that a key frame does not bring back: all that a
// stream can hold, layers, times, velocities, scalars and poses among them; and no mechanics of a body.
// Input: a byte of flags (number of bodies, velocities, mechanics), a byte of size a body, then messages of class
// Frame, each behind two bytes of length; before them, so too, the first body's Mechanics, if there are any. Where it
// begins: the golden vectors (make_seeds.py).
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "codec/frame_codec.h"
#include "codec/topology_hash.h"
#include "fuzz/strip.h"
#include "pneuma_client/frames.h"

using namespace pneuma;

namespace {

constexpr double max_error_m = 0.001;
constexpr double tick_s = 1.0 / 60.0;
constexpr std::uint32_t stream_id = 1;
constexpr std::uint32_t layout_id = 1;
constexpr std::size_t solids = 2;

void must(const base::Status& status) {
  if (!status.ok()) std::abort();
}

/// Of all bodies at rest in the origin.
std::string key_payload(const std::vector<std::uint32_t>& sizes, bool is_simulated) {
  std::vector<codec::MeshOrderPtr> orders;
  for (const std::uint32_t size : sizes) orders.push_back(fuzz::strip_order(size));
  std::vector<codec::SimulatedMotionPtr> simulations(sizes.size());
  if (is_simulated) {
    simulations[0] = std::make_shared<codec::SimulatedMotion>(orders[0], fuzz::strip(sizes[0]),
                                                              fuzz::strip_mechanics(*orders[0]), max_error_m);
  }
  codec::FrameWriter writer(orders, max_error_m, simulations);
  for (std::size_t i = 0; i < sizes.size(); ++i) writer.place_body(i, std::vector<double>(3 * std::size_t{sizes[i]}));
  std::string payload;
  writer.write_key(payload);
  return payload;
}

/// Nothing where the mechanics are refused.
std::optional<client::StreamDecoder> decoder_of(const std::vector<std::uint32_t>& sizes, bool has_velocities,
                                                const std::optional<v1::Mechanics>& mechanics) {
  client::StreamDecoder decoder;
  v1::Subscribed subscribed;
  subscribed.set_stream_id(stream_id);
  subscribed.set_grid_step_m(max_error_m);
  subscribed.set_tick_s(tick_s);
  subscribed.set_velocity_grid_step_m_s(has_velocities ? max_error_m : 0.0);
  must(decoder.add_stream(subscribed));
  v1::Layout layout;
  layout.set_stream_id(stream_id);
  layout.set_layout_id(layout_id);
  for (const std::uint32_t size : sizes) {
    v1::Topology topology;
    const auto indices = fuzz::strip(size);
    topology.set_vertex_count(size);
    topology.mutable_indices()->Add(indices.begin(), indices.end());
    topology.set_hash(codec::topology_hash(size, indices));
    must(decoder.take_topology(topology));
    layout.add_soft_bodies()->set_topology_hash(topology.hash());
  }
  for (std::size_t i = 0; i < solids; ++i) layout.add_solids();
  if (mechanics && !sizes.empty()) {
    *layout.mutable_soft_bodies(0)->mutable_mechanics() = *mechanics;
    if (!decoder.take_layout(layout).ok()) return std::nullopt;
  } else {
    must(decoder.take_layout(layout));
  }
  return decoder;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  std::string_view rest(reinterpret_cast<const char*>(bytes), size);
  if (rest.empty()) return 0;
  const auto flags = static_cast<std::uint8_t>(rest[0]);
  const bool has_velocities = (flags & 1U) != 0;
  const std::size_t count = (flags >> 1U) % 4U;
  if (rest.size() < 1 + count) return 0;
  std::vector<std::uint32_t> sizes;
  for (std::size_t i = 0; i < count; ++i) sizes.push_back(static_cast<std::uint8_t>(rest[1 + i]));
  rest.remove_prefix(1 + count);
  std::optional<v1::Mechanics> mechanics;
  if ((flags & 8U) != 0) {
    const std::string_view message = fuzz::take_message(rest);
    if (!mechanics.emplace().ParseFromArray(message.data(), static_cast<int>(message.size()))) return 0;
  }
  std::optional<client::StreamDecoder> begun = decoder_of(sizes, has_velocities, mechanics);
  if (!begun) return 0;
  client::StreamDecoder& decoder = *begun;

  while (rest.size() >= 2) {
    const std::string_view message = fuzz::take_message(rest);
    v1::Frame frame;
    if (!frame.ParseFromArray(message.data(), static_cast<int>(message.size()))) continue;
    const auto taken = decoder.take_frame(frame, message.size());
    if (!taken.ok() || !taken->has_value()) continue;
    for (std::size_t i = 0; i < count; ++i) {
      const client::SoftBodyFrame& body = (*taken)->bodies.at(i);
      const std::size_t numbers = 3 * std::size_t{sizes[i]};
      if (body.positions_m.size() != numbers || body.velocities_m_s.size() != (has_velocities ? numbers : 0)) {
        std::abort();
      }
    }
  }

  v1::Frame key;
  key.set_stream_id(stream_id);
  key.set_layout_id(layout_id);
  key.set_payload(key_payload(sizes, mechanics && !sizes.empty()));
  if (has_velocities) key.set_velocities(key_payload(sizes, false));
  must(decoder.take_frame(key, 0).status());
  return 0;
}
