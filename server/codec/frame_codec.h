// Frames of a stream as bytes and back; used by server and client alike. The format is proto/WIRE.md, "Frame payload".
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "codec/grid.h"
#include "codec/mechanics_trust.h"
#include "codec/mesh_order.h"
#include "codec/move_coder.h"
#include "codec/payload_heads.h"
#include "codec/points_check.h"
#include "codec/prediction_fit.h"
#include "codec/simulated_motion.h"

namespace pneuma::codec {

using MeshOrderPtr = std::shared_ptr<const MeshOrder>;

/// What the next frame builds on, in the order of a mesh's slots.
struct BodyMotion {
  Lattice points;     // of the last frame
  MoveHistory moves;  // how they came there, frame by frame
  DriftWeights weights;
  std::vector<Lanes> velocities;  // of a body that has mechanics (simulated_motion.h); otherwise empty

  BodyMotion(std::size_t vertices, bool is_simulated) : points(3 * vertices) {
    for (auto& move : moves) move.resize(vertices);
    if (is_simulated) velocities.resize(vertices);
  }
  void come_to_rest() {
    for (auto& move : moves) std::ranges::fill(move, Lanes{});
    std::ranges::fill(velocities, Lanes{});
    weights = {};
  }
  /// After a move that no mechanics expected.
  void take_move_for_velocity() {
    if (!velocities.empty()) take_for_velocities(moves[0], velocities);
  }
  friend bool operator==(const BodyMotion&, const BodyMotion&) = default;
  /// Adds a move to the points.
  void move_by(const std::vector<Lanes>& move);
  /// Makes room for a move: the oldest one comes first.
  void age() { std::ranges::rotate(moves, moves.end() - 1); }
};

/// Makes the payloads of one stream. Delta frames build on the frame before, whoever reads it; a key frame holds all
/// that the next delta frame needs, so that both may be sent of the same frame.
class FrameWriter {
 public:
  /// One order a body, and where any is simulated one of `simulations`, of grid_step_m(max_error_m).
  FrameWriter(std::vector<MeshOrderPtr> orders, double max_error_m, std::vector<SimulatedMotionPtr> simulations = {});

  [[nodiscard]] double grid_step_m() const { return step_m_; }

  /// A delta frame: every body in turn, then take_delta().
  void begin_delta();
  /// positions_m: three a vertex of the mesh, finite and within base::coordinate_max_m. The body's next points are
  /// within the bound of them.
  void move_body(std::size_t body, std::span<const double> positions_m);
  /// Appends the payload.
  void take_delta(std::string& payload);

  /// Instead of a delta frame: the stream begins anew here, at rest.
  void place_body(std::size_t body, std::span<const double> positions_m);

  /// Appends the payload of the last frame as one that stands alone.
  void write_key(std::string& payload) const;

  /// Of the last frame; a reader of it has the same.
  [[nodiscard]] std::uint32_t check() const { return points_check(digests_); }

  [[nodiscard]] const BodyMotion& motion(std::size_t body) const { return motions_[body]; }

 private:
  void gather(const MeshOrder& order, std::span<const double> positions_m);
  [[nodiscard]] bool is_still(const Lattice& points) const;
  [[nodiscard]] std::uint8_t put_simulated(std::size_t body);
  [[nodiscard]] BlockHead put_moved(std::size_t body);
  [[nodiscard]] BlockHead put_better(std::size_t body);
  /// After the body's first moves have changed.
  void note_moves(std::size_t body);
  void catch_up_rings(std::size_t body);

  std::vector<MeshOrderPtr> orders_;
  std::vector<SimulatedMotionPtr> simulations_;  // one a body
  double step_m_;
  double within_m_;  // a point no further from a vertex may stand for it
  std::vector<BodyMotion> motions_;
  std::vector<std::uint32_t> digests_;   // of their points
  std::vector<RingHistory> rings_;       // of their moves
  std::vector<std::uint8_t> rings_lag_;  // one a body: not of its last moves, which were simulated
  std::vector<MechanicsTrust> trusts_;
  // Of the frame under way:
  std::string heads_;
  std::vector<Triple> triples_;
  SymbolWriter symbols_;
  // Of the body under way:
  std::vector<double> positions_m_;  // in the order of the slots
  Lattice points_;
  std::vector<Lanes> moves_;
  std::vector<Lanes> alternatives_;
  std::vector<Lanes> unexpected_moves_;  // before they were chosen by what is expected
  std::vector<Triple> simulated_triples_;
  MoveScratch scratch_;
};

/// Reads the payloads of one stream.
class FrameReader {
 public:
  FrameReader() = default;
  /// As the writer's. Copies share the simulations, which keep nothing from frame to frame.
  explicit FrameReader(std::vector<MeshOrderPtr> orders, std::vector<SimulatedMotionPtr> simulations = {});

  /// Bytes that do not fit change nothing and give a status that names the body and what was wrong. Time and memory are
  /// bounded by the meshes' and the payload's sizes, and simulated_work().
  [[nodiscard]] base::Status read(std::string_view payload, bool key);

  /// Of the last frame. Where it is not the writer's, this reader's points are wrong, and those of what builds on them.
  [[nodiscard]] std::uint32_t check() const { return points_check(digests_); }

  [[nodiscard]] const BodyMotion& motion(std::size_t body) const { return motions_[body]; }
  /// The body's grid coordinates in the last frame, in vertex order.
  void points(std::size_t body, std::span<std::int64_t> out) const;
  void positions(std::size_t body, double step_m, std::span<double> out_m) const;

 private:
  std::vector<MeshOrderPtr> orders_;
  std::vector<SimulatedMotionPtr> simulations_;  // one a body
  std::vector<BodyMotion> motions_;
  std::vector<std::uint32_t> digests_;  // of their points
  // Of the frame under way:
  std::vector<BodyMotion> next_;  // of a body that is only moved, its first move and its velocities alone
  std::vector<std::uint16_t> words_;
  MoveScratch scratch_;
};

}  // namespace pneuma::codec
