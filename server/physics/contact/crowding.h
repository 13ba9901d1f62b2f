// Crowds: bodies that come near so much at once that contact cannot look at it all. Those that ask for most are stopped
// and told (state/runaway.h), since one such body would take the memory and the time of the whole server.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pneuma::physics {

/// Pairs of features of skins, in one look at a world whose skins have so many vertices. The built-in scenes have 4 a
/// vertex at most. The least is more than two balls of 162 vertices have in all; it takes 35 MB.
[[nodiscard]] constexpr std::size_t feature_looks_max(std::size_t vertices) {
  return std::max<std::size_t>(std::size_t{400'000}, 128 * vertices);
}

/// Rows of skins with each other, likewise, of which these scenes have 0.6 a vertex; and of all skins with solids.
[[nodiscard]] constexpr std::size_t skin_rows_max(std::size_t vertices) {
  return std::max<std::size_t>(std::size_t{32'768}, 24 * vertices);
}

/// Contacts of so many rigid bodies with each other and with colliders. A heap of 90 boxes between walls has 13 for
/// each.
[[nodiscard]] constexpr std::size_t rigid_contacts_max(std::size_t bodies) {
  return 4'096 + 64 * bodies;
}

/// Who takes how much of what is limited.
class Takings {
 public:
  void begin(std::size_t bodies) { taken_.assign(bodies, 0); }
  void add(std::uint32_t body, std::size_t count) { taken_[body] += count; }
  void forget(std::uint32_t body) { taken_[body] = 0; }

  /// Those that took at least half as much as the one that took most, in the order of their numbers. None where nobody
  /// took anything.
  [[nodiscard]] std::vector<std::uint32_t> greatest() const {
    std::vector<std::uint32_t> greatest;
    const std::size_t most = taken_.empty() ? 0 : *std::ranges::max_element(taken_);
    for (std::uint32_t i = 0; most > 0 && i < taken_.size(); ++i) {
      if (2 * taken_[i] >= most) greatest.push_back(i);
    }
    return greatest;
  }

 private:
  std::vector<std::size_t> taken_;  // one a body
};

/// Calls find(is_full), which appends items of bodies that are not crowded, and ends once is_full() says that they are
/// too many. Then those bodies that have most are marked as crowded, and it is called again. count(item, takings) adds
/// an item to its bodies.
template <class Body, class Item, class Find, class Count>
void leave_out_crowds(std::span<Body> bodies, std::size_t most, std::vector<Item>& items, const Find& find,
                      const Count& count) {
  const std::size_t begin = items.size();
  const auto is_full = [&] { return items.size() - begin > most; };
  while (true) {
    items.erase(items.begin() + static_cast<std::ptrdiff_t>(begin), items.end());
    find(is_full);
    if (!is_full()) return;
    Takings takings;
    takings.begin(bodies.size());
    for (std::size_t i = begin; i < items.size(); ++i) count(items[i], takings);
    for (const std::uint32_t body : takings.greatest()) bodies[body].is_crowded = true;
  }
}

}  // namespace pneuma::physics
