#include "physics/mesh/ring.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <set>
#include <span>
#include <utility>

namespace pneuma::physics {

namespace {

// Wide enough to leave few slots unused where degrees are mixed, narrow enough that a window's positions stay in L1.
constexpr std::size_t degree_window = 1'024;

// A walk over the slots in order has so many on either side at hand: fetched ahead, or still in cache.
constexpr std::uint32_t near_slots = 512;

constexpr int morton_bits = 21;  // an axis

/// The bits of a 21-bit number, two zeros after each.
std::uint64_t spread_bits(std::uint64_t bits) {
  bits = (bits | bits << 32U) & 0x1f00000000ffffU;
  bits = (bits | bits << 16U) & 0x1f0000ff0000ffU;
  bits = (bits | bits << 8U) & 0x100f00f00f00f00fU;
  bits = (bits | bits << 4U) & 0x10c30c30c30c30c3U;
  return (bits | bits << 2U) & 0x1249249249249249U;
}

std::vector<std::uint32_t> morton_order(const std::vector<Eigen::Vector3d>& positions_m) {
  Eigen::Vector3d low = positions_m.front();
  Eigen::Vector3d high = low;
  for (const Eigen::Vector3d& position : positions_m) {
    low = low.cwiseMin(position);
    high = high.cwiseMax(position);
  }
  const double cells = static_cast<double>(1U << morton_bits) - 1.0;
  const double scale = cells / (high - low).maxCoeff();
  std::vector<std::uint64_t> codes;
  codes.reserve(positions_m.size());
  for (const Eigen::Vector3d& position : positions_m) {
    std::uint64_t code = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = (position[axis] - low[axis]) * scale;
      code = code << 1U | spread_bits(static_cast<std::uint64_t>(std::clamp(cell, 0.0, cells)));
    }
    codes.push_back(code);
  }
  std::vector<std::uint32_t> order(positions_m.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, {}, [&codes](std::uint32_t vertex) { return std::pair(codes[vertex], vertex); });
  return order;
}

/// A face seen from one of its vertices: counter-clockwise, the ring goes from one of the others to the next.
struct Turn {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
};

/// Each vertex's faces as turns, sorted by where they start; the turns of vertex i are [starts[i], starts[i + 1]).
struct Turns {
  std::vector<std::size_t> starts;
  std::vector<Turn> turns;

  explicit Turns(const Mesh& mesh) : starts(mesh.positions_m.size() + 1, 0), turns(3 * mesh.faces.size()) {
    std::inclusive_scan(mesh.face_counts.begin(), mesh.face_counts.end(), starts.begin() + 1, std::plus<>{},
                        std::size_t{0});
    std::vector<std::size_t> next(starts.begin(), starts.end() - 1);
    for (const auto& [a, b, c] : mesh.faces) {
      turns[next[a]++] = {b, c};
      turns[next[b]++] = {c, a};
      turns[next[c]++] = {a, b};
    }
    for (std::size_t i = 0; i + 1 < starts.size(); ++i) std::ranges::sort(of(i), {}, &Turn::from);
  }
  [[nodiscard]] std::span<Turn> of(std::size_t vertex) {
    return std::span(turns).subspan(starts[vertex], starts[vertex + 1] - starts[vertex]);
  }
};

/// Walks the turns of one vertex from `start` on, and marks them as walked. False where the walk does not close.
bool walk_fan(std::span<const Turn> turns, std::size_t start, std::vector<bool>& walked,
              std::vector<std::uint32_t>& ring) {
  std::size_t at = start;
  for (;;) {
    walked[at] = true;
    ring.push_back(turns[at].from);
    const std::uint32_t to = turns[at].to;
    if (to == turns[start].from) return true;
    const auto next = std::ranges::lower_bound(turns, to, {}, &Turn::from);
    if (next == turns.end() || next->from != to) {
      ring.push_back(to);
      return false;
    }
    at = static_cast<std::size_t>(next - turns.begin());
  }
}

/// The neighbours of one vertex, fan by fan: the open ones, then the closed ones. True for a single closed fan.
bool walk_ring(std::span<const Turn> turns, std::vector<std::uint32_t>& ring) {
  std::vector<std::uint32_t> ends;
  for (const Turn& turn : turns) ends.push_back(turn.to);
  std::ranges::sort(ends);
  std::vector<bool> walked(turns.size(), false);
  for (std::size_t i = 0; i < turns.size(); ++i) {
    if (!std::ranges::binary_search(ends, turns[i].from)) walk_fan(turns, i, walked, ring);
  }
  bool closed = ring.empty();
  for (std::size_t i = 0; i < turns.size(); ++i) {
    if (walked[i]) continue;
    closed = closed && ring.empty();
    walk_fan(turns, i, walked, ring);
  }
  return closed;
}

std::size_t edge_between(const Mesh& mesh, std::uint32_t a, std::uint32_t b) {
  const Edge edge{std::min(a, b), std::max(a, b)};
  return static_cast<std::size_t>(std::ranges::lower_bound(mesh.edges, edge) - mesh.edges.begin());
}

void list_far_neighbours(Rings& rings) {
  for (std::size_t p = 0; p < rings.packs.size(); ++p) {
    RingPack& pack = rings.packs[p];
    const auto slot = static_cast<std::uint32_t>(p * pack_slots);
    const auto of_pack = std::span(rings.neighbours).subspan(pack.first, pack.degree * pack_slots);
    std::set<std::uint32_t> far;
    for (const std::uint32_t neighbour : of_pack) {
      const std::uint32_t other = neighbour / 4;
      if (std::max(slot, other) - std::min(slot, other) > near_slots) far.insert(neighbour);
    }
    pack.far_begin = static_cast<std::uint32_t>(rings.far_neighbours.size());
    rings.far_neighbours.insert(rings.far_neighbours.end(), far.begin(), far.end());
    pack.far_end = static_cast<std::uint32_t>(rings.far_neighbours.size());
  }
  rings.far_neighbours.shrink_to_fit();
}

}  // namespace

Rings make_rings(const Mesh& mesh) {
  const std::size_t count = mesh.positions_m.size();
  Turns turns(mesh);
  std::vector<std::vector<std::uint32_t>> ring_of(count);
  Rings rings;
  rings.encloses = true;
  for (std::size_t i = 0; i < count; ++i) rings.encloses = walk_ring(turns.of(i), ring_of[i]) && rings.encloses;

  std::vector<std::uint32_t> order = morton_order(mesh.positions_m);
  std::vector<std::uint32_t> rank(count);
  for (std::uint32_t i = 0; i < count; ++i) rank[order[i]] = i;
  const auto degree = [&ring_of](std::uint32_t vertex) { return ring_of[vertex].size(); };
  rings.slots.resize(count);
  for (std::size_t begin = 0; begin < count; begin += degree_window) {
    const std::span window = std::span(order).subspan(begin, std::min(degree_window, count - begin));
    std::ranges::sort(window, {}, [&](std::uint32_t vertex) { return std::pair(degree(vertex), rank[vertex]); });
    for (std::size_t i = 0, end = 0; i < window.size(); i = end) {
      while (end < window.size() && end < i + pack_slots && degree(window[end]) == degree(window[i])) ++end;
      RingPack pack;
      pack.degree = static_cast<std::uint32_t>(degree(window[i]));
      pack.count = static_cast<std::uint32_t>(end - i);
      for (std::size_t slot = 0; slot < pack_slots; ++slot) {
        const std::uint32_t vertex = window[std::min(i + slot, end - 1)];
        if (slot < pack.count) rings.slots[vertex] = static_cast<std::uint32_t>(rings.vertices.size());
        rings.vertices.push_back(vertex);
      }
      rings.packs.push_back(pack);
    }
  }
  rings.neighbours.reserve(pack_slots * std::transform_reduce(rings.packs.begin(), rings.packs.end(), std::size_t{0},
                                                              std::plus<>{},
                                                              [](const RingPack& pack) { return pack.degree; }));
  for (std::size_t p = 0; p < rings.packs.size(); ++p) {
    RingPack& pack = rings.packs[p];
    pack.first = static_cast<std::uint32_t>(rings.neighbours.size());
    for (std::size_t place = 0; place < pack.degree; ++place) {
      for (std::size_t slot = 0; slot < pack_slots; ++slot) {
        const std::uint32_t vertex = rings.vertices[p * pack_slots + slot];
        rings.neighbours.push_back(4 * rings.slots[ring_of[vertex][place]]);
      }
    }
  }
  rings.vertices.shrink_to_fit();
  rings.packs.shrink_to_fit();
  list_far_neighbours(rings);
  return rings;
}

template <class Real>
RingEdges<Real> make_ring_edges(const Mesh& mesh, const Rings& rings, std::span<const double> stiffness_scales) {
  constexpr std::uint32_t not_met = ~std::uint32_t{0};
  std::vector<std::uint32_t> numbers(mesh.edges.size(), not_met);
  RingEdges<Real> edges;
  edges.of_ring.resize(rings.neighbours.size());
  for (std::size_t slot = 0; slot < rings.slot_count(); ++slot) {
    const RingPack& pack = rings.packs[slot / pack_slots];
    for (std::size_t place = 0; place < pack.degree; ++place) {
      const std::size_t entry = pack.first + place * pack_slots + slot % pack_slots;
      const std::uint32_t neighbour = rings.neighbours[entry] / 4;
      const std::size_t edge = edge_between(mesh, rings.vertices[slot], rings.vertices[neighbour]);
      if (numbers[edge] == not_met) {
        numbers[edge] = static_cast<std::uint32_t>(edges.lengths_m.size());
        edges.ends.insert(edges.ends.end(), {static_cast<std::uint32_t>(slot), neighbour});
        edges.lengths_m.push_back(static_cast<Real>(mesh.edge_lengths_m[edge]));
        if (!stiffness_scales.empty()) edges.stiffness_scales.push_back(static_cast<Real>(stiffness_scales[edge]));
      }
      edges.of_ring[entry] = numbers[edge];
    }
  }
  return edges;
}

template <class Real>
std::vector<Real> along_rings(const Mesh& mesh, const Rings& rings, std::span<const double> of_edges,
                              const std::array<std::uint8_t, pack_slots>& slot_of_place) {
  std::vector<Real> numbers;
  numbers.reserve(rings.neighbours.size());
  for (std::size_t p = 0; p < rings.packs.size(); ++p) {
    for (std::size_t place = 0; place < rings.packs[p].degree; ++place) {
      for (const std::uint8_t slot : slot_of_place) {
        const std::uint32_t vertex = rings.vertices[p * pack_slots + slot];
        const std::size_t entry = rings.packs[p].first + place * pack_slots + slot;
        const std::uint32_t neighbour = rings.vertices[rings.neighbours[entry] / 4];
        numbers.push_back(static_cast<Real>(of_edges[edge_between(mesh, vertex, neighbour)]));
      }
    }
  }
  return numbers;
}

template <class Real>
std::vector<Real> ring_lengths_m(const Mesh& mesh, const Rings& rings,
                                 const std::array<std::uint8_t, pack_slots>& slot_of_place) {
  return along_rings<Real>(mesh, rings, mesh.edge_lengths_m, slot_of_place);
}

#define PNEUMA_INSTANTIATE(Real)                                                                      \
  template RingEdges<Real> make_ring_edges<Real>(const Mesh&, const Rings&, std::span<const double>); \
  template std::vector<Real> along_rings<Real>(const Mesh&, const Rings&, std::span<const double>,    \
                                               const std::array<std::uint8_t, pack_slots>&);          \
  template std::vector<Real> ring_lengths_m<Real>(const Mesh&, const Rings&,                          \
                                                  const std::array<std::uint8_t, pack_slots>&);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
