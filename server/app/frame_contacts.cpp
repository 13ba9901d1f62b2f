#include "app/frame_contacts.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "base/limits.h"
#include "scene_io/vectors.h"

namespace pneuma::app {

namespace {

struct Found {
  std::size_t place;   // among all, by body and vertex
  std::uint32_t soft;  // in the layout
  TouchedVertex touched;
};

/// Scatters the vertices evenly (the golden ratio of 2^32, Knuth 6.4), so that those with the least are spread over the
/// body; where others come and go, only those at the edge of the choice change.
std::uint32_t rank_of(const Found& found) {
  return found.touched.vertex * 2'654'435'769U;
}

}  // namespace

google::protobuf::RepeatedPtrField<v1::Contact> contacts_of(const FrameSource& source, const WorldLayout& layout) {
  std::vector<Found> all;
  std::vector<std::optional<std::uint32_t>> in_layout(source.soft_body_count());
  const auto& bodies = layout.bodies();
  for (std::uint32_t i = 0; i < bodies.size(); ++i) in_layout[bodies[i].index] = i;
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    for (const TouchedVertex& touched : source.contacts(bodies[i].index)) all.push_back({all.size(), i, touched});
  }
  if (all.size() > base::frame_contacts_max) {
    const auto before = [](const Found& a, const Found& b) {
      return std::pair(rank_of(a), a.place) < std::pair(rank_of(b), b.place);
    };
    std::ranges::nth_element(all, all.begin() + static_cast<std::ptrdiff_t>(base::frame_contacts_max), before);
    all.resize(base::frame_contacts_max);
    std::ranges::sort(all, {}, &Found::place);
  }
  google::protobuf::RepeatedPtrField<v1::Contact> contacts;
  contacts.Reserve(static_cast<int>(all.size()));
  for (const auto& [place, soft, touched] : all) {
    v1::Contact& contact = *contacts.Add();
    contact.set_soft(soft);
    contact.set_vertex(touched.vertex);
    if (!touched.is_of_soft_body) contact.set_other_solid(static_cast<std::uint32_t>(touched.other));
    if (touched.is_of_soft_body && in_layout[touched.other]) contact.set_other_soft(*in_layout[touched.other]);
    scene_io::set(*contact.mutable_normal(), touched.normal);
  }
  return contacts;
}

}  // namespace pneuma::app
