#include "physics/contact/row_turns.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

namespace pneuma::physics {
namespace {

// Past the last turn, rows that share a vertex share the turn too.
constexpr std::uint32_t turns_max = 64;

// Calls visit(body, vertex) for each vertex that the row moves.
template <class Visit>
void for_moved(const ContactRow& row, std::span<const SurfaceBody> bodies, const Visit& visit) {
  for (const Support* side : {&row.first, &row.second}) {
    for (std::uint32_t i = 0; i < side->count; ++i) {
      if (bodies[side->body].inverse_masses_1_kg[side->vertices[i]] > 0.0) visit(side->body, side->vertices[i]);
    }
  }
}

}  // namespace

// Each row takes the first turn that no row of its vertices has.
void RowTurns::sort(std::vector<ContactRow>& rows, std::span<const SurfaceBody> bodies) {
  taken_.resize(bodies.size());
  turn_of_.resize(rows.size());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    std::uint64_t taken = 0;
    for_moved(rows[r], bodies, [&](std::uint32_t body, std::uint32_t vertex) {
      const std::size_t vertices = bodies[body].inverse_masses_1_kg.size();
      if (taken_[body].size() < vertices) taken_[body].resize(vertices);
      taken |= taken_[body][vertex];
    });
    turn_of_[r] = std::min(static_cast<std::uint32_t>(std::countr_one(taken)), turns_max - 1);
    for_moved(rows[r], bodies, [&](std::uint32_t body, std::uint32_t vertex) {
      taken_[body][vertex] |= std::uint64_t{1} << turn_of_[r];
    });
  }
  for (const ContactRow& row : rows) {
    for_moved(row, bodies, [&](std::uint32_t body, std::uint32_t vertex) { taken_[body][vertex] = 0; });
  }
  // A place for each turn, one after the other.
  std::array<std::size_t, turns_max + 1> places{};
  for (const std::uint32_t turn : turn_of_) ++places[turn + 1];
  std::partial_sum(places.begin(), places.end(), places.begin());
  sorted_.resize(rows.size());
  for (std::size_t r = 0; r < rows.size(); ++r) sorted_[places[turn_of_[r]]++] = rows[r];
  rows.swap(sorted_);
}

std::size_t RowTurns::bytes() const {
  std::size_t sum = turn_of_.capacity() * sizeof(std::uint32_t) + sorted_.capacity() * sizeof(ContactRow);
  for (const auto& of_body : taken_) sum += of_body.capacity() * sizeof(std::uint64_t);
  return sum;
}

}  // namespace pneuma::physics
