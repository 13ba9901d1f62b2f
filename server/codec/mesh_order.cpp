#include "codec/mesh_order.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace pneuma::codec {

namespace {

/// Lists of numbers, one a key, in one array.
struct Lists {
  std::vector<std::uint32_t> begins;
  std::vector<std::uint32_t> entries;

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

/// A part of the vertices, and which of them count as neighbours.
struct Level {
  std::vector<std::uint32_t> ranks;   // of its vertices, ascending
  Lists neighbours;                   // by rank
  std::vector<std::uint8_t> colours;  // by rank

  [[nodiscard]] bool has_neighbours() const { return !neighbours.entries.empty(); }
};

/// All vertices; the neighbours of each by ascending rank.
Level finest(const std::vector<std::uint32_t>& vertices, const Lists& neighbours) {
  std::vector<std::uint32_t> ranks(vertices.size());
  for (std::uint32_t rank = 0; rank < vertices.size(); ++rank) ranks[vertices[rank]] = rank;
  Level level;
  auto& [begins, entries] = level.neighbours;
  begins.push_back(0);
  for (std::uint32_t rank = 0; rank < vertices.size(); ++rank) {
    level.ranks.push_back(rank);
    const auto begin = static_cast<std::ptrdiff_t>(entries.size());
    for (const std::uint32_t vertex : neighbours.of(vertices[rank])) entries.push_back(ranks[vertex]);
    std::sort(entries.begin() + begin, entries.end());
    begins.push_back(static_cast<std::uint32_t>(entries.size()));
  }
  return level;
}

constexpr std::size_t levels_max = 12;
constexpr std::uint32_t colours_max = 8;
// Of the neighbours that a coarser level's are found by, and of those that are found: a mesh made to have more costs
// no more.
constexpr std::size_t neighbours_looked_at_max = 16;

/// Each gets the least colour that none of its neighbours has yet, or the last.
void colour(Level& level, std::size_t vertex_count) {
  constexpr std::uint8_t none = colours_max;
  level.colours.assign(vertex_count, none);
  for (const std::uint32_t rank : level.ranks) {
    std::uint32_t taken = 0;
    for (const std::uint32_t neighbour : level.neighbours.of(rank)) taken |= 1U << level.colours[neighbour];
    const auto least = static_cast<std::uint32_t>(std::countr_one(taken));
    level.colours[rank] = static_cast<std::uint8_t>(std::min(least, colours_max - 1));
  }
}

/// The vertices of colour 0; those with a neighbour in common are neighbours.
Level coarser(const Level& level, std::size_t vertex_count) {
  const auto looked_at = [&level](std::uint32_t rank) {
    const auto all = level.neighbours.of(rank);
    return all.first(std::min(all.size(), neighbours_looked_at_max));
  };
  Level coarse;
  auto& [begins, entries] = coarse.neighbours;
  begins.reserve(vertex_count + 1);
  begins.push_back(0);
  for (std::uint32_t rank = 0; rank < vertex_count; ++rank) {
    const auto begin = static_cast<std::ptrdiff_t>(entries.size());
    if (level.colours[rank] == 0) {
      coarse.ranks.push_back(rank);
      for (const std::uint32_t between : looked_at(rank)) {
        for (const std::uint32_t far : looked_at(between)) {
          if (far == rank || level.colours[far] != 0) continue;
          if (entries.size() - static_cast<std::size_t>(begin) == neighbours_looked_at_max) continue;
          if (std::find(entries.begin() + begin, entries.end(), far) == entries.end()) entries.push_back(far);
        }
      }
    }
    begins.push_back(static_cast<std::uint32_t>(entries.size()));
  }
  return coarse;
}

/// Ranks in the order in which they are coded, each with its parents: ranks too.
struct CodingOrder {
  std::vector<std::uint32_t> ranks;
  std::vector<std::vector<std::uint32_t>> parents;  // one a slot
};

CodingOrder coarse_to_fine(const std::vector<Level>& levels, std::size_t vertex_count) {
  CodingOrder order;
  std::vector<bool> coded(vertex_count);
  for (std::size_t at = levels.size(); at-- > 0;) {
    const Level& level = levels[at];
    for (std::uint32_t colour = at + 1 == levels.size() ? 0 : 1; colour < colours_max; ++colour) {
      for (const std::uint32_t rank : level.ranks) {
        if (level.colours[rank] != colour) continue;
        auto& parents = order.parents.emplace_back();
        for (const std::uint32_t neighbour : level.neighbours.of(rank)) {
          if (coded[neighbour] && parents.size() < parents_max) parents.push_back(neighbour);
        }
        coded[rank] = true;
        order.ranks.push_back(rank);
      }
    }
  }
  return order;
}

}  // namespace

MeshOrder make_mesh_order(std::uint32_t vertex_count, std::span<const std::uint32_t> indices) {
  const Lists faces = faces_at_vertices(vertex_count, indices);
  const Lists neighbours = neighbours_of(vertex_count, indices, faces);
  const std::vector<std::uint32_t> vertices = breadth_first(vertex_count, neighbours);  // by rank
  std::vector<Level> levels{finest(vertices, neighbours)};
  colour(levels.back(), vertex_count);
  while (levels.back().has_neighbours() && levels.size() < levels_max) {
    levels.push_back(coarser(levels.back(), vertex_count));
    colour(levels.back(), vertex_count);
  }
  const CodingOrder coding = coarse_to_fine(levels, vertex_count);
  std::vector<std::uint32_t> slots(vertex_count);  // by rank
  for (std::uint32_t slot = 0; slot < vertex_count; ++slot) slots[coding.ranks[slot]] = slot;

  MeshOrder order;
  order.ring_rest_begins.push_back(0);
  std::uint32_t run_begin = 0;
  for (std::uint32_t slot = 0; slot < vertex_count; ++slot) {
    const std::uint32_t rank = coding.ranks[slot];
    order.vertices.push_back(vertices[rank]);
    auto& ring = order.rings.emplace_back();
    ring.fill(slot);
    std::size_t degree = 0;
    for (const std::uint32_t neighbour : levels[0].neighbours.of(rank)) {
      if (degree < ring.size()) {
        ring[degree++] = slots[neighbour];
      } else {
        order.ring_rests.push_back(slots[neighbour]);
      }
    }
    order.ring_rest_begins.push_back(static_cast<std::uint32_t>(order.ring_rests.size()));
    MeshOrder::Parents& parents = order.parents.emplace_back();
    for (const std::uint32_t parent : coding.parents[slot]) parents.slots[parents.count++] = slots[parent] + 1;
    if (std::ranges::any_of(parents.slots, [run_begin](std::uint32_t entry) { return entry > run_begin; })) {
      order.run_ends.push_back(slot);
      run_begin = slot;
    }
  }
  if (vertex_count > 0) order.run_ends.push_back(vertex_count);
  return order;
}

}  // namespace pneuma::codec
