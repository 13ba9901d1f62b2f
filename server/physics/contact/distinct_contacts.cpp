#include "physics/contact/distinct_contacts.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <tuple>

namespace pneuma::physics {

ContactNotes distinct(ContactNotes notes) {
  const auto place = [](const VertexContact& note) { return std::pair(note.vertex, note.other); };
  const auto order = [&](const VertexContact& note) {
    return std::tuple(place(note), note.normal.x(), note.normal.y(), note.normal.z());
  };
  std::ranges::sort(notes, {}, order);
  // A vertex may be answered again and again by one wall; in a room's corner, by several, in any order of normals.
  const auto is_one_wall = [](const VertexContact& a, const VertexContact& b) {
    constexpr double same_wall = 1e-3;
    return a.normal.dot(b.normal) > 1.0 - same_wall;
  };
  ContactNotes walls;
  std::size_t begin = 0;  // of those of the same vertex and other
  for (const VertexContact& note : notes) {
    if (begin < walls.size() && place(walls[begin]) != place(note)) begin = walls.size();
    const auto same_place = std::span(walls).subspan(begin);
    const auto is_same = [&](const VertexContact& wall) { return is_one_wall(wall, note); };
    if (std::ranges::none_of(same_place, is_same)) walls.push_back(note);
  }
  return walls;
}

}  // namespace pneuma::physics
