#include "codec/mesh_order.h"

#include <algorithm>
#include <functional>
#include <utility>

namespace pneuma::codec {

namespace {

constexpr std::uint32_t nowhere = ~std::uint32_t{0};
// Around both ends of an edge: a mesh made to have more costs no more.
constexpr std::size_t faces_looked_at_max = 32;

/// Lists of numbers, one a key, in one array.
struct Lists {
  std::vector<std::uint32_t> begins;
  std::vector<std::uint32_t> entries;

  [[nodiscard]] std::span<std::uint32_t> of(std::size_t key) {
    return std::span(entries).subspan(begins[key], begins[key + 1] - begins[key]);
  }
  [[nodiscard]] std::span<const std::uint32_t> of(std::size_t key) const {
    return std::span(entries).subspan(begins[key], begins[key + 1] - begins[key]);
  }
};

/// The faces at each vertex, in order.
Lists faces_at_vertices(std::uint32_t vertex_count, std::span<const std::uint32_t> indices) {
  Lists lists;
  lists.begins.resize(std::size_t{vertex_count} + 1);
  for (const std::uint32_t vertex : indices) ++lists.begins[vertex + 1];
  for (std::size_t i = 0; i < vertex_count; ++i) lists.begins[i + 1] += lists.begins[i];
  lists.entries.resize(indices.size());
  std::vector<std::uint32_t> next(lists.begins.begin(), lists.begins.end() - 1);
  for (std::size_t corner = 0; corner < indices.size(); ++corner) {
    lists.entries[next[indices[corner]]++] = static_cast<std::uint32_t>(corner / 3);
  }
  return lists;
}

/// The vertices that share a face with each vertex, in ascending order.
Lists neighbours_of(std::uint32_t vertex_count, std::span<const std::uint32_t> indices, const Lists& faces) {
  Lists lists;
  lists.begins.reserve(std::size_t{vertex_count} + 1);
  lists.begins.push_back(0);
  lists.entries.reserve(2 * indices.size());
  for (std::uint32_t vertex = 0; vertex < vertex_count; ++vertex) {
    const auto begin = static_cast<std::ptrdiff_t>(lists.entries.size());
    for (const std::uint32_t face : faces.of(vertex)) {
      for (const std::uint32_t other : indices.subspan(3 * std::size_t{face}, 3)) {
        if (other != vertex) lists.entries.push_back(other);
      }
    }
    std::sort(lists.entries.begin() + begin, lists.entries.end());
    lists.entries.erase(std::unique(lists.entries.begin() + begin, lists.entries.end()), lists.entries.end());
    lists.begins.push_back(static_cast<std::uint32_t>(lists.entries.size()));
  }
  return lists;
}

/// Breadth first, from the lowest vertex of each part, a vertex's neighbours in ascending order.
std::vector<std::uint32_t> breadth_first(std::uint32_t vertex_count, const Lists& neighbours) {
  std::vector<std::uint32_t> order;
  order.reserve(vertex_count);
  std::vector<bool> seen(vertex_count);
  for (std::uint32_t start = 0; start < vertex_count; ++start) {
    if (seen[start]) continue;
    seen[start] = true;
    order.push_back(start);
    for (std::size_t next = order.size() - 1; next < order.size(); ++next) {
      for (const std::uint32_t neighbour : neighbours.of(order[next])) {
        if (seen[neighbour]) continue;
        seen[neighbour] = true;
        order.push_back(neighbour);
      }
    }
  }
  return order;
}

/// The latest four neighbours coded before; fewer come again from the first.
std::array<std::uint32_t, 4> parents_of(std::uint32_t slot, std::span<const std::uint32_t> ring) {
  std::vector<std::uint32_t> before;
  for (const std::uint32_t neighbour : ring) {
    if (neighbour < slot) before.push_back(neighbour + 1);
  }
  std::ranges::sort(before, std::greater<>());
  std::array<std::uint32_t, 4> parents{};
  if (before.empty()) return parents;
  for (std::size_t i = 0; i < parents.size(); ++i) parents[i] = before[i % std::min(before.size(), parents.size())];
  return parents;
}

class ParallelogramFinder {
 public:
  ParallelogramFinder(std::span<const std::uint32_t> indices, const Lists& faces, std::span<const std::uint32_t> slots)
      : indices_(indices), faces_(faces), slots_(slots) {}

  /// Of the first two faces at the vertex that have a parallelogram, or of one twice; otherwise the mean of two
  /// parents.
  [[nodiscard]] std::array<std::uint32_t, 6> at(std::uint32_t vertex,
                                                const std::array<std::uint32_t, 4>& parents) const {
    std::array<std::uint32_t, 6> found{parents[0], 0, parents[1], 0, 0, 0};
    std::size_t count = 0;
    for (const std::uint32_t face : faces_.of(vertex)) {
      const auto corners = indices_.subspan(3 * std::size_t{face}, 3);
      const std::size_t corner = corners[0] == vertex ? 0 : corners[1] == vertex ? 1 : 2;
      const std::uint32_t a = corners[(corner + 1) % 3];
      const std::uint32_t b = corners[(corner + 2) % 3];
      if (slots_[a] >= slots_[vertex] || slots_[b] >= slots_[vertex]) continue;
      const std::uint32_t c = across(a, b, vertex);
      if (c == nowhere) continue;
      for (std::size_t place = count; place < 2; ++place) {
        found[2 * place] = slots_[a] + 1;
        found[2 * place + 1] = slots_[b] + 1;
        found[4 + place] = slots_[c] + 1;
      }
      if (++count == 2) break;
    }
    return found;
  }

 private:
  /// The third vertex of the first face with the edge a b whose third vertex is coded before `vertex`.
  [[nodiscard]] std::uint32_t across(std::uint32_t a, std::uint32_t b, std::uint32_t vertex) const {
    const auto at_a = faces_.of(a);
    const auto at_b = faces_.of(b);
    const auto fewer = at_b.size() < at_a.size() ? at_b : at_a;
    for (const std::uint32_t face : fewer.first(std::min(fewer.size(), faces_looked_at_max))) {
      const auto corners = indices_.subspan(3 * std::size_t{face}, 3);
      if (std::ranges::find(corners, a) == corners.end() || std::ranges::find(corners, b) == corners.end()) continue;
      const auto third = std::ranges::find_if(
          corners, [&](std::uint32_t corner) { return corner != a && corner != b && slots_[corner] < slots_[vertex]; });
      if (third != corners.end()) return *third;
    }
    return nowhere;
  }

  std::span<const std::uint32_t> indices_;
  const Lists& faces_;
  std::span<const std::uint32_t> slots_;
};

}  // namespace

MeshOrder make_mesh_order(std::uint32_t vertex_count, std::span<const std::uint32_t> indices) {
  const Lists faces = faces_at_vertices(vertex_count, indices);
  const Lists neighbours = neighbours_of(vertex_count, indices, faces);
  MeshOrder order;
  order.vertices = breadth_first(vertex_count, neighbours);
  std::vector<std::uint32_t> slots(vertex_count);
  for (std::uint32_t slot = 0; slot < vertex_count; ++slot) slots[order.vertices[slot]] = slot;

  order.rings.reserve(neighbours.entries.size());
  order.ring_begins.push_back(0);
  order.parents.reserve(vertex_count);
  order.parallelograms.reserve(vertex_count);
  const ParallelogramFinder parallelograms(indices, faces, slots);
  for (std::uint32_t slot = 0; slot < vertex_count; ++slot) {
    const std::size_t begin = order.rings.size();
    for (const std::uint32_t neighbour : neighbours.of(order.vertices[slot])) order.rings.push_back(slots[neighbour]);
    order.ring_begins.push_back(static_cast<std::uint32_t>(order.rings.size()));
    order.parents.push_back(parents_of(slot, std::span(order.rings).subspan(begin)));
    order.parallelograms.push_back(parallelograms.at(order.vertices[slot], order.parents.back()));
  }
  return order;
}

}  // namespace pneuma::codec
