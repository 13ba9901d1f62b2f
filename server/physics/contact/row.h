// A contact, or a part of a joint: one row for every kind of partner.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "physics/scene/scene.h"

namespace pneuma::physics {

/// The point of a body at which a row acts: up to three vertices with weights, or a point of a solid.
struct Support {
  std::uint32_t body = 0;   // a response's index
  std::uint32_t count = 0;  // vertices; 0 of a solid
  std::array<std::uint32_t, 3> vertices{};
  std::array<double, 3> weights{};
  Vec3d arm = Vec3d::Zero();  // of a solid: from its centre, m
  bool turns = false;         // of a solid: the row is about its turning, rad/s and N m s, not about a point of it
  std::uint32_t slot = 0;     // in the response's own tables

  void add(std::uint32_t vertex, double weight) {
    if (weight == 0.0) return;
    vertices[count] = vertex;
    weights[count++] = weight;
  }
};

/// At the support's vertices, by their weights.
[[nodiscard]] inline Vec3d mean_of(const Support& at, std::span<const Vec3d> values) {
  Vec3d sum = Vec3d::Zero();
  for (std::uint32_t i = 0; i < at.count; ++i) sum += at.weights[i] * values[at.vertices[i]];
  return sum;
}

/// What touches what, whatever the order in which it was found. Rows are solved in this order.
struct FeatureKey {
  std::uint64_t bodies = 0;
  std::uint64_t features = 0;
  auto operator<=>(const FeatureKey&) const = default;
};

/// Kinds of contacts: none shares a key with one of another kind.
enum class FeatureKind : std::uint8_t {
  vertex_face,
  vertex_edge,
  vertex_vertex,
  edge_edge,
  solid_vertex,
  solid_corner,
  solid_edge,
  way_out,  // of a body that was put across a mesh
  rigid,    // two rigid bodies, or one and a collider
};

/// `first` and `second` are responses' indices.
[[nodiscard]] inline FeatureKey feature_key(FeatureKind kind, std::uint32_t first, std::uint32_t second,
                                            std::uint64_t features) {
  return {(static_cast<std::uint64_t>(first) << 32U) | (static_cast<std::uint64_t>(second) << 8U) |
              static_cast<std::uint64_t>(kind),
          features};
}

/// What a row allows. `contact`: to part, and to slide against friction. `tie`: nothing. `guide`: what is along the
/// normal.
enum class RowKind : std::uint8_t { contact, tie, guide };

struct ContactRow {
  FeatureKey key;
  RowKind kind = RowKind::contact;
  Support first;
  Support second;
  Vec3d normal = Vec3d::UnitY();  // unit, from the second to the first
  double gap_m = 0.0;             // along it, over the distance that the two keep
  double friction = 0.0;
  double restitution = 0.0;
  double softness_1_kg = 0.0;                                 // it gives way by so much velocity an impulse
  double most_n_s = std::numeric_limits<double>::infinity();  // that it can take
  bool is_given = false;                                      // its impulse stays as it is

  // What the solver is to reach.
  Vec3d free_m_s = Vec3d::Zero();  // the first as seen from the second, without an impulse
  double least_m_s = 0.0;          // along the normal, with it
  // What it found.
  Vec3d impulse_n_s = Vec3d::Zero();  // on the first; the second gets its opposite
};

/// What a row held when it was last solved, from which its next solve starts.
struct WarmImpulse {
  FeatureKey key;
  Vec3d impulse_n_s = Vec3d::Zero();
};

/// Of the rows that took more than they can, the one that did by most; null where there is none.
[[nodiscard]] inline ContactRow* most_overtaxed(std::span<ContactRow> rows) {
  ContactRow* most = nullptr;
  double most_over = 1.0;
  for (ContactRow& row : rows) {
    const double over = row.is_given ? 0.0 : row.impulse_n_s.norm() / row.most_n_s;
    if (!(over > most_over)) continue;  // nor one without bounds, which is no number here
    most_over = over;
    most = &row;
  }
  return most;
}

/// What the rows of one world's substeps came to, added up.
struct RowCounts {
  std::uint64_t rows = 0;
  std::uint64_t unconverged = 0;   // solves, of a group each, that ended before the rows agreed
  std::uint64_t cut_vertices = 0;  // moves that were cut short, so that nothing crosses

  RowCounts operator+(const RowCounts& other) const {
    return {rows + other.rows, unconverged + other.unconverged, cut_vertices + other.cut_vertices};
  }
};

}  // namespace pneuma::physics
