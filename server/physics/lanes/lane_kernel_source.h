// The lane kernels' one source; see lane_kernels.h for what they do and lane_pack.h for who may include this.
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "physics/lanes/lane_kernels.h"
#include "physics/lanes/lane_pack.h"

namespace pneuma::physics {
inline namespace PNEUMA_LANES {

/// Three components of a vector, in lanes.
template <class P>
struct Vector {
  P x;
  P y;
  P z;

  static Vector zero() { return {P::all(0), P::all(0), P::all(0)}; }
  friend Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend P dot(const Vector& a, const Vector& b) { return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x)); }
  /// sum + scale a
  friend Vector add(const Vector& sum, const P& scale, const Vector& a) {
    return {fma(scale, a.x, sum.x), fma(scale, a.y, sum.y), fma(scale, a.z, sum.z)};
  }
  /// sum + a x b
  friend Vector add_cross(const Vector& sum, const Vector& a, const Vector& b) {
    return {fnma(a.z, b.y, fma(a.y, b.z, sum.x)), fnma(a.x, b.z, fma(a.z, b.x, sum.y)),
            fnma(a.y, b.x, fma(a.x, b.y, sum.z))};
  }
};

/// Where slot i of a pack stands among the packs' entries once they are in lane order, and back.
template <class P>
struct LaneOrder {
  unsigned char place_of_slot[pack_slots] = {};
  unsigned char slot_of_place[pack_slots] = {};

  consteval LaneOrder() {
    for (std::size_t place = 0; place < pack_slots; ++place) {
      const std::size_t slot = place / P::width * P::width + P::slot_of_lane(place % P::width);
      slot_of_place[place] = static_cast<unsigned char>(slot);
      place_of_slot[slot] = static_cast<unsigned char>(place);
    }
  }
};
template <class P>
inline constexpr LaneOrder<P> lane_order;

/// The two layouts behind one face: a ring pass walks `groups` of each pack, one vertex a lane or one body a lane.
template <class P, class Real>
struct FleetAccess {
  static Vector<P> load(const Real* from, std::size_t slot) {
    const Real* at = from + slot * 3 * P::width;
    return {P::load(at), P::load(at + P::width), P::load(at + 2 * P::width)};
  }
  static void store(Real* to, std::size_t slot, const Vector<P>& value) {
    Real* at = to + slot * 3 * P::width;
    value.x.store(at);
    value.y.store(at + P::width);
    value.z.store(at + 2 * P::width);
  }
  static Vector<P> neighbour(const Real* from, const std::uint32_t* offsets) {
    if constexpr (3 * P::width % 4 == 0) {
      return load(from + std::size_t{*offsets} * (3 * P::width / 4), 0);  // one operation less than by the slot
    } else {
      return load(from, *offsets / 4);
    }
  }
  static P length(const Real* lengths, std::size_t slot) { return P::all(lengths[lane_order<P>.place_of_slot[slot]]); }
  static Vector<P> first(const Real* from) { return load(from, 0); }
  static constexpr std::size_t slots = 1;  // that one step takes
};

template <class P, class Real>
struct AloneAccess {
  static Vector<P> load(const Real* from, std::size_t slot) {
    Vector<P> value;
    P::load_rows(from + 4 * slot, value.x, value.y, value.z);
    return value;
  }
  static void store(Real* to, std::size_t slot, const Vector<P>& value) {
    P::store_rows(to + 4 * slot, value.x, value.y, value.z);
  }
  static Vector<P> neighbour(const Real* from, const std::uint32_t* offsets) {
    Vector<P> value;
    P::gather(from, offsets, value.x, value.y, value.z);
    return value;
  }
  static P length(const Real* lengths, std::size_t slot) { return P::load(lengths + slot); }
  static Vector<P> first(const Real* from) { return {P::all(from[0]), P::all(from[1]), P::all(from[2])}; }
  static constexpr std::size_t slots = P::width;
};

template <class P, class Real, LaneLayout Layout>
struct AccessTo {
  using Type = FleetAccess<P, Real>;
};
template <class P, class Real>
struct AccessTo<P, Real, LaneLayout::alone> {
  using Type = AloneAccess<P, Real>;
};

/// The sums of a block: one for each of the 16 places of a slot in its pack, added up in one tree at the end.
template <class P, class Real, class Access>
class BlockSum {
 public:
  BlockSum() {
    for (P& partial : partials_) partial = P::all(0);
  }
  /// Of the slots from `slot` on; of those only as many as are in use.
  void add(std::size_t slot, std::size_t in_use, const P& term) {
    P& partial = partials_[slot / Access::slots];
    if (slot + Access::slots <= in_use) {
      partial = partial + term;
      return;
    }
    Real terms[P::width];
    term.store(terms);
    for (std::size_t lane = 0; lane < P::width; ++lane) {
      if (slot + P::slot_of_lane(lane) >= in_use) terms[lane] = 0;
    }
    partial = partial + P::load(terms);
  }
  void total(PerLane<Real>& sums) const {
    if constexpr (Access::slots == 1) {
      P level[pack_slots];
      for (std::size_t i = 0; i < pack_slots; ++i) level[i] = partials_[i];
      for (std::size_t half = pack_slots / 2; half > 0; half /= 2) {
        for (std::size_t i = 0; i < half; ++i) level[i] = level[i] + level[i + half];
      }
      level[0].store(sums.lanes);
    } else {
      Real places[pack_slots];
      for (std::size_t i = 0; i < pack_slots / P::width; ++i) partials_[i].store(places + i * P::width);
      Real level[pack_slots];
      for (std::size_t i = 0; i < pack_slots; ++i) level[lane_order<P>.slot_of_place[i]] = places[i];
      for (std::size_t half = pack_slots / 2; half > 0; half /= 2) {
        for (std::size_t i = 0; i < half; ++i) level[i] += level[i + half];
      }
      sums.lanes[0] = level[0];
    }
  }

 private:
  P partials_[pack_slots / Access::slots];
};

template <class P>
struct Spring {
  P stiffness;
  P rest_scale;
  P damping;

  [[nodiscard]] Spring scaled(const P& stiffness_scale) const {
    return {stiffness * stiffness_scale, rest_scale, damping};
  }

  // It pulls by (k (L - rest) + c L') / L times the way d to the neighbour, and L' = (dv . d) / L. Seen from the other
  // end, with d and dv reversed, that has the same bits.
  template <bool Damped, class Rate>
  P pull(const Vector<P>& along, const P& rest_shape_m, const Rate& rate) const {
    const P squared = dot(along, along);
    const P length = sqrt(squared);
    const P inverse = P::all(1) / length;
    P tension = stiffness * fnma(rest_scale, rest_shape_m, length);
    if constexpr (Damped) tension = fma(damping, dot(rate(), along) * inverse, tension);
    return where_positive(squared, tension * inverse);  // in one place there is no direction to pull in
  }
};

template <class P, class Real>
Spring<P> spring_of(const RingPass<Real>& pass) {
  return {P::load(pass.stiffness_n_m.lanes), P::load(pass.rest_scale.lanes), P::load(pass.damping_n_s_m.lanes)};
}

template <class P, class Real, bool Scaled, bool Damped>
void pull_pass(RingPass<Real>& pass) {
  using Access = FleetAccess<P, Real>;
  const Spring<P> spring = spring_of<P>(pass);
  for (std::size_t edge = 0; edge < pass.edge_count; ++edge) {
    const std::size_t from = pass.edge_ends[2 * edge];
    const std::size_t to = pass.edge_ends[2 * edge + 1];
    const Vector<P> along = Access::load(pass.x, to) - Access::load(pass.x, from);
    const auto rate = [&] { return Access::load(pass.v, to) - Access::load(pass.v, from); };
    P pull;
    if constexpr (Scaled) {
      const Spring<P> scaled = spring.scaled(P::all(pass.edge_stiffness_scales[edge]));
      pull = scaled.template pull<Damped>(along, P::all(pass.edge_lengths_m[edge]), rate);
    } else {
      pull = spring.template pull<Damped>(along, P::all(pass.edge_lengths_m[edge]), rate);
    }
    pull.store(pass.pulls_n_m + edge * P::width);
  }
}

/// Asks for what the packs ahead of `p` will need. The processor sees the rows coming, but too late, and not the far
/// neighbours at all. Measured on 655,362 vertices: half the time. Always inline: GCC 12 drops calls of a function that
/// does nothing else.
template <class Real, bool Scaled, bool Damped, bool Gas>
[[gnu::always_inline]] inline void fetch_ahead(const RingPass<Real>& pass, std::size_t p) {
  constexpr std::size_t rows_ahead = 48;
  constexpr std::size_t far_ahead = 8;
  constexpr std::size_t line = 64 / sizeof(Real);
  const std::size_t row = 4 * (p + rows_ahead) * pack_slots;
  if (p + rows_ahead < pass.fetch_end) {
    const RingPack& pack = pass.packs[p + rows_ahead];
    for (std::size_t i = 0; i < 4 * pack_slots; i += line) {
      __builtin_prefetch(pass.x + row + i);
      if constexpr (Damped) __builtin_prefetch(pass.v + row + i);
      __builtin_prefetch(pass.force + row + i, 1);
      if constexpr (Gas) __builtin_prefetch(pass.gradient + row + i, 1);
    }
    for (std::size_t i = 0; i < pack.degree * pack_slots; i += line)
      __builtin_prefetch(pass.lengths_m + pack.first + i);
    if constexpr (Scaled) {
      for (std::size_t i = 0; i < pack.degree * pack_slots; i += line)
        __builtin_prefetch(pass.stiffness_scales + pack.first + i);
    }
    for (std::size_t i = 0; i < pack.degree * pack_slots; i += pack_slots) {
      __builtin_prefetch(pass.neighbours + pack.first + i);
    }
  }
  if (p + far_ahead < pass.fetch_end) {
    const RingPack& pack = pass.packs[p + far_ahead];
    for (std::size_t i = pack.far_begin; i < pack.far_end; ++i) {
      __builtin_prefetch(pass.x + pass.far_neighbours[i]);
      if constexpr (Damped) __builtin_prefetch(pass.v + pass.far_neighbours[i]);
    }
  }
}

/// A ring pass's way through one pack after the other.
template <class P, class Real, class Access, bool Scaled, bool Damped, bool Gas, bool Pulled>
class RingSums {
 public:
  explicit RingSums(const RingPass<Real>& pass)
      : pass_(pass), spring_(spring_of<P>(pass)), origin_(Access::first(pass.x)) {}

  /// `KnownDegree` is the pack's degree, or 0 where that is any.
  template <std::size_t KnownDegree>
  [[gnu::always_inline]] void add_pack(std::size_t p) {
    const RingPack pack = pass_.packs[p];
    const std::size_t degree = KnownDegree == 0 ? pack.degree : KnownDegree;
    for (std::size_t in_pack = 0; in_pack < pack.count; in_pack += Access::slots) {
      const std::size_t slot = p * pack_slots + in_pack;
      const Vector<P> x = Access::load(pass_.x, slot);
      Vector<P> v;
      if constexpr (Damped) v = Access::load(pass_.v, slot);
      const std::uint32_t* neighbours = pass_.neighbours + pack.first + in_pack;
      const Real* lengths_m = pass_.lengths_m + pack.first;
      Vector<P> force = Vector<P>::zero();
      Vector<P> gradient = Vector<P>::zero();
      Vector<P> before;
      if constexpr (Gas) before = Access::neighbour(pass_.x, neighbours + (degree - 1) * pack_slots) - x;
      const auto add_neighbour = [&](std::size_t place) {
        const Vector<P> along = Access::neighbour(pass_.x, neighbours + place * pack_slots) - x;
        P pull;
        if constexpr (Pulled) {
          pull = P::load(pass_.pulls_n_m + pass_.ring_edges[pack.first + in_pack + place * pack_slots] * P::width);
        } else {
          const auto rate = [&] { return Access::neighbour(pass_.v, neighbours + place * pack_slots) - v; };
          const P length_m = Access::length(lengths_m + place * pack_slots, in_pack);
          if constexpr (Scaled) {
            const Real* scales = pass_.stiffness_scales + pack.first + place * pack_slots;
            pull = spring_.scaled(Access::length(scales, in_pack)).template pull<Damped>(along, length_m, rate);
          } else {
            pull = spring_.template pull<Damped>(along, length_m, rate);
          }
        }
        force = add(force, pull, along);
        if constexpr (Gas) {
          gradient = add_cross(gradient, before, along);
          before = along;
        }
      };
      if constexpr (KnownDegree == 0) {
        for (std::size_t place = 0; place < degree; ++place) add_neighbour(place);
      } else {
#pragma GCC unroll 8
        for (std::size_t place = 0; place < KnownDegree; ++place) add_neighbour(place);
      }
      Access::store(pass_.force, slot, force);
      if constexpr (Gas) {
        Access::store(pass_.gradient, slot, gradient);
        volume_.add(in_pack, pack.count, dot(x - origin_, gradient));
      }
    }
  }
  void total(PerLane<Real>& volumes_18_m3) const { volume_.total(volumes_18_m3); }

 private:
  const RingPass<Real>& pass_;
  Spring<P> spring_;
  Vector<P> origin_;
  BlockSum<P, Real, Access> volume_;
};

template <class P, class Real, class Access, bool Scaled, bool Damped, bool Gas, bool Pulled>
void ring_pass(RingPass<Real>& pass) {
  RingSums<P, Real, Access, Scaled, Damped, Gas, Pulled> sums(pass);
  for (std::size_t p = pass.begin; p < pass.end; ++p) {
    if constexpr (Access::slots > 1) {
      fetch_ahead<Real, Scaled, Damped, Gas>(pass, p);
      sums.template add_pack<0>(p);
    } else if (pass.packs[p].degree == 6) {
      // Most of a closed mesh's vertices have six neighbours. The loop of known length is a tenth faster for a fleet,
      // and slower for a body alone.
      sums.template add_pack<6>(p);
    } else {
      sums.template add_pack<0>(p);
    }
  }
  if constexpr (Gas) sums.total(*pass.volumes_18_m3);
}

template <class P, class Real, bool Gas>
void weigh_pass(const WeighPass<Real>& pass) {
  for (std::size_t at = pass.begin; at < pass.end; at += P::width) {
    const P inverse_share = P::load(pass.inverse_shares + at);
    (inverse_share * P::load(pass.force + at)).store(pass.force + at);
    if constexpr (Gas) (inverse_share * P::load(pass.gradient + at)).store(pass.gradient + at);
  }
}

/// Elementwise, so that both layouts are the same loop over rows of lanes: a fleet has a row for each component of a
/// slot, a body alone has x, y, z, 0 of several slots in one row (or of one slot in several, where rows are short).
template <class P, class Real, LaneLayout Layout, Substage Method, bool Gas, bool Advance>
void update_pass(UpdatePass<Real>& pass) {
  constexpr bool fleet = Layout == LaneLayout::fleet;
  constexpr std::size_t rows = fleet ? 3 : (P::width < 4 ? 4 / P::width : 1);  // until the components come round
  constexpr std::size_t per_slot = fleet ? 3 * P::width : 4;
  P gravity[rows];
  for (std::size_t row = 0; row < rows; ++row) {
    Real components[P::width];
    for (std::size_t lane = 0; lane < P::width; ++lane) {
      components[lane] = pass.gravity_m_s2[fleet ? row : (row * P::width + lane) % 4];
    }
    gravity[row] = P::load(components);
  }
  const auto per_lane = [](const PerLane<Real>& of) { return fleet ? P::load(of.lanes) : P::all(of.lanes[0]); };
  const P inverse_mass = per_lane(pass.inverse_mass_1_kg);
  const P pressure = per_lane(pass.pressure_sixth_pa);
  const P h = P::all(pass.dt_s);
  const P half = P::all(pass.dt_s * Real{0.5});
  const P sixth = P::all(pass.dt_s / Real{6});
  const P two = P::all(2);
  P v_max = per_lane(pass.v_max_m_s);
  P move_max = per_lane(pass.move_max_m);

  for (std::size_t first = pass.begin * per_slot; first < pass.end * per_slot; first += rows * P::width) {
    for (std::size_t row = 0; row < rows; ++row) {
      const std::size_t at = first + row * P::width;
      P force = P::load(pass.force + at);
      if constexpr (Gas) force = fma(pressure, P::load(pass.gradient + at), force);
      const P acceleration = fma(force, inverse_mass, gravity[row]);
      const P v = P::load(pass.v + at);

      const auto go_to_stage = [&](const P& share, const P& x_slope) {
        fma(share, x_slope, P::load(pass.x + at)).store(pass.x_stage + at);
        fma(share, acceleration, v).store(pass.v_stage + at);
      };
      const auto finish = [&](const P& move, const P& v_after) {
        v_after.store(pass.v + at);
        v_max = largest(v_max, v_after);
        move_max = largest(move_max, move);
        if constexpr (Advance) {
          (P::load(pass.x + at) + move).store(pass.x + at);
        } else {
          move.store(pass.move + at);
        }
      };
      if constexpr (Method == Substage::euler) {
        finish(h * v, fma(h, acceleration, v));
      } else if constexpr (Method == Substage::symplectic) {
        const P v_after = fma(h, acceleration, v);
        finish(h * v_after, v_after);
      } else if constexpr (Method == Substage::midpoint_half) {
        go_to_stage(half, v);
      } else if constexpr (Method == Substage::midpoint_full) {
        finish(h * P::load(pass.v_stage + at), fma(h, acceleration, v));
      } else if constexpr (Method == Substage::rk4_first) {
        v.store(pass.x_slopes + at);
        acceleration.store(pass.v_slopes + at);
        go_to_stage(half, v);
      } else {
        const P v_stage = P::load(pass.v_stage + at);
        const P x_slopes = P::load(pass.x_slopes + at);
        const P v_slopes = P::load(pass.v_slopes + at);
        if constexpr (Method == Substage::rk4_fourth) {
          finish(sixth * (x_slopes + v_stage), fma(sixth, v_slopes + acceleration, v));
        } else {
          fma(two, v_stage, x_slopes).store(pass.x_slopes + at);
          fma(two, acceleration, v_slopes).store(pass.v_slopes + at);
          go_to_stage(Method == Substage::rk4_second ? half : h, v_stage);
        }
      }
    }
  }
  if constexpr (fleet) {
    v_max.store(pass.v_max_m_s.lanes);
    move_max.store(pass.move_max_m.lanes);
  } else {
    Real v_lanes[P::width];
    Real move_lanes[P::width];
    v_max.store(v_lanes);
    move_max.store(move_lanes);
    for (std::size_t lane = 0; lane < P::width; ++lane) {
      if (v_lanes[lane] > pass.v_max_m_s.lanes[0]) pass.v_max_m_s.lanes[0] = v_lanes[lane];
      if (move_lanes[lane] > pass.move_max_m.lanes[0]) pass.move_max_m.lanes[0] = move_lanes[lane];
    }
  }
}

// Three packs at a time, so that a lane keeps its axis. Minima and maxima are the same in any order.
template <class P, class Real>
void extent_pass(const ExtentPass<Real>& pass) {
  constexpr std::size_t packs = 3;
  constexpr std::size_t span = packs * P::width;
  struct Range {
    P low = P::all(std::numeric_limits<Real>::infinity());
    P high = P::all(-std::numeric_limits<Real>::infinity());

    void take(const P& value) {
      low = lower(value, low);
      high = higher(value, high);
    }
  };
  struct Ranges {
    Range x, end, move;
  };
  std::array<Ranges, packs> ranges;
  P v_max = P::all(0);
  P not_finite = P::all(0);
  const std::size_t whole = pass.numbers / span * span;
  for (std::size_t at = 0; at < whole; at += span) {
    for (std::size_t k = 0; k < packs; ++k) {
      const std::size_t i = at + k * P::width;
      const P x = P::load(pass.x + i);
      const P move = P::load(pass.move + i);
      const P v = P::load(pass.v + i);
      const P end = x + move;
      ranges[k].x.take(x);
      ranges[k].end.take(end);
      ranges[k].move.take(move);
      v_max = largest(v_max, v);
      not_finite = not_finite + (end - end) + (v - v);  // 0, or no number
    }
  }
  Extents<Real>& extents = *pass.extents;
  extents = {};
  const auto take = [&](std::size_t axis, Real x, Real end, Real move) {
    extents.x[axis].take(x);
    extents.end[axis].take(end);
    extents.move[axis].take(move);
  };
  // Folded in halves, each of whole vertices, down to one.
  const auto fold = [&](Span<Real>(&of_axes)[3], const auto& range_of) {
    Real low[span];
    Real high[span];
    for (std::size_t k = 0; k < packs; ++k) {
      range_of(ranges[k]).low.store(low + k * P::width);
      range_of(ranges[k]).high.store(high + k * P::width);
    }
    for (std::size_t half = span / 2; half >= 3; half /= 2) {
      for (std::size_t i = 0; i < half; ++i) low[i] = low[i + half] < low[i] ? low[i + half] : low[i];
      for (std::size_t i = 0; i < half; ++i) high[i] = high[i + half] > high[i] ? high[i + half] : high[i];
    }
    for (std::size_t axis = 0; axis < 3; ++axis) of_axes[axis] = {low[axis], high[axis]};
  };
  fold(extents.x, [](const Ranges& of) -> const Range& { return of.x; });
  fold(extents.end, [](const Ranges& of) -> const Range& { return of.end; });
  fold(extents.move, [](const Ranges& of) -> const Range& { return of.move; });
  Real speeds[P::width];
  Real lost[P::width];
  v_max.store(speeds);
  not_finite.store(lost);
  Real lost_sum = 0;
  for (std::size_t lane = 0; lane < P::width; ++lane) {
    extents.v_max_m_s = speeds[lane] > extents.v_max_m_s ? speeds[lane] : extents.v_max_m_s;
    lost_sum += lost[lane];
  }
  extents.finite = lost_sum == 0;
  for (std::size_t i = whole; i < pass.numbers; ++i) {
    const Real end = pass.x[i] + pass.move[i];
    take(i % 3, pass.x[i], end, pass.move[i]);
    extents.v_max_m_s = std::max(extents.v_max_m_s, std::abs(pass.v[i]));
    extents.finite = extents.finite && end - end == 0 && pass.v[i] - pass.v[i] == 0;
  }
}

template <class P, class Real, LaneLayout Layout>
consteval void list_layout(LaneKernels<Real>& kernels) {
  using Access = typename AccessTo<P, Real, Layout>::Type;
  constexpr auto layout = static_cast<std::size_t>(Layout);
  const auto list_rings = [&]<bool Scaled, bool Damped>() {
    kernels.rings[layout][Scaled][Damped] = {&ring_pass<P, Real, Access, Scaled, Damped, false, false>,
                                             &ring_pass<P, Real, Access, Scaled, Damped, true, false>};
  };
  list_rings.template operator()<false, false>();
  list_rings.template operator()<false, true>();
  list_rings.template operator()<true, false>();
  list_rings.template operator()<true, true>();
  const auto list_substage = [&]<Substage Method>(bool last) {
    auto& updates = kernels.updates[layout][static_cast<std::size_t>(Method)];
    updates[0][0] = &update_pass<P, Real, Layout, Method, false, false>;
    updates[1][0] = &update_pass<P, Real, Layout, Method, true, false>;
    updates[0][1] = last ? &update_pass<P, Real, Layout, Method, false, true> : updates[0][0];
    updates[1][1] = last ? &update_pass<P, Real, Layout, Method, true, true> : updates[1][0];
  };
  list_substage.template operator()<Substage::euler>(true);
  list_substage.template operator()<Substage::symplectic>(true);
  list_substage.template operator()<Substage::midpoint_half>(false);
  list_substage.template operator()<Substage::midpoint_full>(true);
  list_substage.template operator()<Substage::rk4_first>(false);
  list_substage.template operator()<Substage::rk4_second>(false);
  list_substage.template operator()<Substage::rk4_third>(false);
  list_substage.template operator()<Substage::rk4_fourth>(true);
}

template <class P>
consteval LaneKernels<typename P::Real> list_kernels() {
  using Real = typename P::Real;
  LaneKernels<Real> kernels;
  kernels.width = P::width;
  kernels.slots_per_ms = P::slots_per_ms;
  for (std::size_t place = 0; place < pack_slots; ++place) {
    kernels.slot_of_place[place] = lane_order<P>.slot_of_place[place];
  }
  kernels.pulls[0] = {&pull_pass<P, Real, false, false>, &pull_pass<P, Real, false, true>};
  kernels.pulls[1] = {&pull_pass<P, Real, true, false>, &pull_pass<P, Real, true, true>};
  kernels.pulled_rings = {&ring_pass<P, Real, FleetAccess<P, Real>, false, false, false, true>,
                          &ring_pass<P, Real, FleetAccess<P, Real>, false, false, true, true>};
  kernels.weighs = {&weigh_pass<P, Real, false>, &weigh_pass<P, Real, true>};
  kernels.extents = &extent_pass<P, Real>;
  list_layout<P, Real, LaneLayout::fleet>(kernels);
  list_layout<P, Real, LaneLayout::alone>(kernels);
  return kernels;
}

}  // namespace PNEUMA_LANES
}  // namespace pneuma::physics
