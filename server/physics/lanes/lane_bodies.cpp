#include "physics/lanes/lane_bodies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/limits.h"
#include "physics/lanes/lane_team.h"

namespace pneuma::physics {

template <class Real>
std::size_t LaneMesh<Real>::bytes() const {
  const std::size_t indices = rings.vertices.capacity() + rings.slots.capacity() + rings.neighbours.capacity() +
                              edges.ends.capacity() + edges.of_ring.capacity() + rings.far_neighbours.capacity();
  return rings.packs.capacity() * sizeof(RingPack) + indices * sizeof(std::uint32_t) +
         (lengths_m.capacity() + edges.lengths_m.capacity()) * sizeof(Real) +
         (stiffness_scales.capacity() + edges.stiffness_scales.capacity()) * sizeof(Real) +
         vertex_stiffness_scale.capacity() * sizeof(double);
}

template <class Real>
LaneScratch<Real>::LaneScratch() = default;
template <class Real>
LaneScratch<Real>::~LaneScratch() = default;
template <class Real>
LaneScratch<Real>::LaneScratch(const LaneScratch&) : LaneScratch() {}
template <class Real>
LaneScratch<Real>::LaneScratch(LaneScratch&&) noexcept = default;
template <class Real>
LaneScratch<Real>& LaneScratch<Real>::operator=(LaneScratch&&) noexcept = default;

template <class Real>
std::size_t LaneScratch<Real>::bytes() const {
  std::size_t numbers = 0;
  for (const LaneArray<Real>* array :
       {&x, &v, &force, &gradient, &inverse_shares, &pulls, &move, &x_stage, &v_stage, &x_slopes, &v_slopes}) {
    numbers += array->capacity();
  }
  numbers += 3 * (other_x.capacity() + other_v.capacity() + other_force.capacity());
  return numbers * sizeof(Real) + block_volumes.capacity() * sizeof(PerLane<Real>) +
         pinned_slots.capacity() * sizeof(std::uint32_t) + (team ? team->bytes() : 0);
}

template <class Real>
std::size_t LaneRooms<Real>::bytes() const {
  std::size_t sum = 0;
  for (const LaneScratch<Real>& scratch : of_threads) sum += scratch.bytes();
  return sum;
}

template <class Real>
bool LaneRooms<Real>::has_team() const {
  return std::ranges::any_of(of_threads, [](const LaneScratch<Real>& scratch) { return scratch.team != nullptr; });
}

template <class Real>
void LaneBodies<Real>::load(bool gas, bool weighed) const {
  clear_unused_slots(scratch_.force);
  if (gas) clear_unused_slots(scratch_.gradient);
  if (weighed) load_shares();
  if (layout_ == LaneLayout::alone) {
    const SoftState<Real>& body = *bodies_[0];
    for (std::size_t slot = slots_begin(); slot < slots_end(); ++slot) {
      const std::uint32_t vertex = mesh_.rings.vertices[slot];
      put_row(body.x[vertex], scratch_.x, slot);
      put_row(body.v[vertex], scratch_.v, slot);
    }
    return;
  }
  std::array<const Vec3<Real>*, pack_slots> x{};
  std::array<const Vec3<Real>*, pack_slots> v{};
  for (std::size_t lane = 0; lane < width_; ++lane) {
    x[lane] = of_lane(lane).x.data();
    v[lane] = of_lane(lane).v.data();
  }
  Real* to_x = scratch_.x.data();
  Real* to_v = scratch_.v.data();
  for (const std::uint32_t vertex : mesh_.rings.vertices) {
    for (std::size_t lane = 0; lane < width_; ++lane) {
      for (std::size_t c = 0; c < 3; ++c) {
        to_x[c * width_ + lane] = x[lane][vertex][static_cast<Eigen::Index>(c)];
        to_v[c * width_ + lane] = v[lane][vertex][static_cast<Eigen::Index>(c)];
      }
    }
    to_x += 3 * width_;
    to_v += 3 * width_;
  }
}

template <class Real>
void LaneBodies<Real>::load_shares() const {
  if (layout_ == LaneLayout::alone) {
    for (std::size_t slot = slots_begin(); slot < slots_end(); ++slot) {
      const auto inverse = static_cast<Real>(1.0 / bodies_[0]->mass_shares[mesh_.rings.vertices[slot]]);
      put_row<Real>({inverse, inverse, inverse}, scratch_.inverse_shares, slot);
    }
    return;
  }
  for (std::size_t slot = slots_begin(); slot < slots_end(); ++slot) {
    for (std::size_t lane = 0; lane < width_; ++lane) {
      const auto inverse = static_cast<Real>(1.0 / of_lane(lane).mass_shares[mesh_.rings.vertices[slot]]);
      for (std::size_t c = 0; c < 3; ++c) scratch_.inverse_shares[at(slot, c, lane)] = inverse;
    }
  }
}

// The ring pass leaves them out, and other bodies may have used them, but the update goes over all.
template <class Real>
void LaneBodies<Real>::clear_unused_slots(LaneArray<Real>& array) const {
  for (std::size_t p = packs_begin(); p < packs_end(); ++p) {
    const std::size_t used_end = p * pack_slots + mesh_.rings.packs[p].count;
    const auto begin = array.begin() + static_cast<std::ptrdiff_t>(at(used_end, 0, 0));
    const auto end = array.begin() + static_cast<std::ptrdiff_t>(at((p + 1) * pack_slots, 0, 0));
    std::fill(begin, end, Real{0});
  }
}

template <class Real>
void LaneBodies<Real>::store(std::span<const std::uint8_t> wanted, bool advance) const {
  if (layout_ == LaneLayout::alone) {
    if (wanted[0] == 0) return;
    SoftState<Real>& body = *bodies_[0];
    std::vector<Vec3<Real>>& moved = advance ? body.x : body.dr;
    const Real* moved_lanes = advance ? scratch_.x.data() : scratch_.move.data();
    const Real* v_lanes = scratch_.v.data();
    for_slots([&](std::size_t slot, std::uint32_t vertex) {
      const Real* from = moved_lanes + 4 * slot;
      const Real* v = v_lanes + 4 * slot;
      moved[vertex] = {from[0], from[1], from[2]};
      body.v[vertex] = {v[0], v[1], v[2]};
    });
    return;
  }
  std::array<Vec3<Real>*, pack_slots> to_moved{};
  std::array<Vec3<Real>*, pack_slots> to_v{};
  std::array<std::size_t, pack_slots> lanes{};
  std::size_t count = 0;
  const Real* const moved_lanes = advance ? scratch_.x.data() : scratch_.move.data();
  for (std::size_t lane = 0; lane < bodies_.size(); ++lane) {
    if (wanted[lane] == 0) continue;
    to_moved[count] = (advance ? bodies_[lane]->x : bodies_[lane]->dr).data();
    to_v[count] = bodies_[lane]->v.data();
    lanes[count++] = lane;
  }
  for_slots([&](std::size_t slot, std::uint32_t vertex) {
    const Real* moved = moved_lanes + at(slot, 0, 0);
    const Real* v = scratch_.v.data() + at(slot, 0, 0);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t lane = lanes[i];
      to_moved[i][vertex] = {moved[lane], moved[width_ + lane], moved[2 * width_ + lane]};
      to_v[i][vertex] = {v[lane], v[width_ + lane], v[2 * width_ + lane]};
    }
  });
}

template <class Real>
void LaneBodies<Real>::find_well(std::uint32_t substeps, const PerLane<Real>& v_max_m_s,
                                 const PerLane<Real>& move_max_m, std::span<std::uint8_t> well) const {
  const auto root_3 = std::numbers::sqrt3_v<Real>;
  const auto speed_max = static_cast<Real>(base::speed_max_m_s) / root_3;
  std::array<Real, pack_slots> reach_max{};  // one a number of a row of pack_slots; all rows are alike
  for (std::size_t lane = 0; lane < bodies_.size(); ++lane) {
    const Real move_max = move_max_m.lanes[lane];
    // Two moves differ by at most twice the longest; a part in a thousand is for rounding.
    const Real stray_max = static_cast<Real>(0.999 * base::runaway_body_lengths) * bodies_[lane]->length_m;
    well[lane] = v_max_m_s.lanes[lane] <= speed_max && 2 * root_3 * move_max <= stray_max ? 1 : 0;
    const double reach_m = base::coordinate_max_m - bodies_[lane]->origin_m.cwiseAbs().maxCoeff();
    for (std::size_t i = lane; i < pack_slots; i += width_) {
      reach_max[i] = static_cast<Real>(reach_m) - static_cast<Real>(substeps) * move_max;
    }
  }
  std::array<std::int32_t, pack_slots> outside{};  // whether any number at a place of its row is
  for (std::size_t row = at(slots_begin(), 0, 0); row < at(slots_end(), 0, 0); row += pack_slots) {
    const Real* x = scratch_.x.data() + row;
    const Real* v = scratch_.v.data() + row;
    for (std::size_t i = 0; i < pack_slots; ++i) {  // the 0 after each z of a body alone is not outside
      const bool near = std::abs(x[i]) <= reach_max[i];
      const bool slow = std::abs(v[i]) <= speed_max;
      outside[i] |= static_cast<std::int32_t>(!(near & slow));
    }
  }
  for (std::size_t i = 0; i < pack_slots; ++i) {
    if (outside[i] != 0 && i % width_ < bodies_.size()) well[i % width_] = 0;
  }
}

#define PNEUMA_INSTANTIATE(Real)     \
  template struct LaneMesh<Real>;    \
  template struct LaneScratch<Real>; \
  template struct LaneRooms<Real>;   \
  template class LaneBodies<Real>;
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
