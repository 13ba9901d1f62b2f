#include "bench/frame_costs.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bench/codec_peers.h"
#include "bench/median.h"
#include "codec/frame_codec.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::bench {

namespace {

using support::Recording;
using Clock = std::chrono::steady_clock;

constexpr std::size_t length_prefix_bytes = 4;

double since_ns(Clock::time_point start) {
  return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
}

/// Of a delta frame, as it is sent.
std::size_t message_bytes(const std::string& payload, std::uint64_t tick, std::uint32_t check) {
  v1::ServerMessage message;
  v1::Frame& frame = *message.mutable_frame();
  frame.set_stream_id(1);
  frame.set_tick(tick);
  frame.set_base_tick(tick - 1);
  frame.set_payload(payload);
  frame.set_check(check);
  return length_prefix_bytes + message.ByteSizeLong();
}

}  // namespace

FrameCost frame_cost(const Recording& recording, double max_error_m,
                     const std::vector<std::optional<codec::Mechanics>>& mechanics) {
  const double step_m = codec::grid_step_m(max_error_m);
  codec::FrameWriter writer(recording.orders, max_error_m, support::simulations_of(recording, mechanics, step_m));
  codec::FrameReader reader(recording.orders, support::simulations_of(recording, mechanics, step_m));
  std::string payload;
  const auto read = [&](bool key) {
    if (!reader.read(payload, key).ok()) throw std::runtime_error("a frame does not read back");
  };
  for (std::size_t body = 0; body < recording.orders.size(); ++body) {
    writer.place_body(body, recording.frames_m[0][body]);
  }
  writer.write_key(payload);
  read(true);
  FrameCost cost;
  cost.error_max_m = support::furthest_m(recording, 0, reader, writer.grid_step_m());
  std::vector<double> write_ns;
  std::vector<double> read_ns;
  double bytes = 0.0;
  for (std::size_t tick = 1; tick < recording.frames_m.size(); ++tick) {
    payload.clear();
    const auto start = Clock::now();
    writer.begin_delta();
    for (std::size_t body = 0; body < recording.orders.size(); ++body) {
      writer.move_body(body, recording.frames_m[tick][body]);
    }
    writer.take_delta(payload);
    const std::uint32_t check = writer.check();
    write_ns.push_back(since_ns(start));
    const auto written = Clock::now();
    read(false);
    const std::uint32_t found = reader.check();
    read_ns.push_back(since_ns(written));
    if (found != check) throw std::runtime_error("a frame does not read back");
    bytes += static_cast<double>(message_bytes(payload, tick, check));
    cost.error_max_m = std::max(cost.error_max_m, support::furthest_m(recording, tick, reader, writer.grid_step_m()));
  }
  const auto vertices = static_cast<double>(recording.vertex_count());
  cost.bits = 8.0 * bytes / (vertices * static_cast<double>(write_ns.size()));
  cost.write_ns = median(std::move(write_ns)) / vertices;
  cost.read_ns = median(std::move(read_ns)) / vertices;
  return cost;
}

PeerBits peer_bits(const Recording& recording, double max_error_m) {
  const double step_m = 2.0 * max_error_m / std::sqrt(3.0);
  PeerBytes sum;
  for (std::size_t tick = 2; tick < recording.frames_m.size(); ++tick) {
    std::vector<std::int32_t> residuals;
    for (std::size_t body = 0; body < recording.orders.size(); ++body) {
      for (std::size_t i = 0; i < recording.frames_m[tick][body].size(); ++i) {
        const auto cell = [&](std::size_t at) { return std::llround(recording.frames_m[at][body][i] / step_m); };
        residuals.push_back(static_cast<std::int32_t>(cell(tick) - 2 * cell(tick - 1) + cell(tick - 2)));
      }
    }
    const PeerBytes bytes = peer_bytes(residuals);
    sum.zstd += bytes.zstd;
    sum.meshoptimizer += bytes.meshoptimizer;
    sum.draco += bytes.draco;
  }
  const double vertex_frames =
      static_cast<double>(recording.frames_m.size() - 2) * static_cast<double>(recording.vertex_count());
  const auto bits = [&](std::size_t bytes) { return 8.0 * static_cast<double>(bytes) / vertex_frames; };
  return {bits(sum.zstd), bits(sum.meshoptimizer), bits(sum.draco)};
}

}  // namespace pneuma::bench
