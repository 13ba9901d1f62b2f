#include "codec/simulated_motion.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "codec/clones.h"
#include "codec/prediction.h"

namespace pneuma::codec {

namespace {

using FourDoubles [[gnu::vector_size(32)]] = double;
using FourWords [[gnu::vector_size(32)]] = std::int64_t;

// How much of what a frame shows beyond its prediction is taken for velocity.
constexpr double velocity_gain = 0.2;
// A simulated vertex that goes further in a frame has left what can be told, and so has its body.
constexpr double steps_a_frame_max = 0x1p26;
constexpr double velocity_max = steps_a_frame_max / velocity_unit;
// Shorter edges have no direction to push in.
constexpr double square_length_min = 0x1p-10;
// A gas pressed to less of its volume is no gas any more.
constexpr double volume_share_min = 0x1p-6;
// So many times the way that is free before a plane counts in a frame.
constexpr double reach = 2.0;

double sum(const FourDoubles& v) {
  return (v[0] + v[1]) + (v[2] + v[3]);
}
FourDoubles all(double value) {
  return FourDoubles{value, value, value, value};
}
/// The lanes of `v` added up, for four vectors at once, as sum() does.
FourDoubles sums(const FourDoubles& a, const FourDoubles& b, const FourDoubles& c, const FourDoubles& d) {
  const FourDoubles ab = __builtin_shufflevector(a, b, 0, 4, 2, 6) + __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const FourDoubles cd = __builtin_shufflevector(c, d, 0, 4, 2, 6) + __builtin_shufflevector(c, d, 1, 5, 3, 7);
  return __builtin_shufflevector(ab, cd, 0, 1, 4, 5) + __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
}
FourDoubles cross(const FourDoubles& a, const FourDoubles& b) {
  return __builtin_shufflevector(a, a, 1, 2, 0, 3) * __builtin_shufflevector(b, b, 2, 0, 1, 3) -
         __builtin_shufflevector(a, a, 2, 0, 1, 3) * __builtin_shufflevector(b, b, 1, 2, 0, 3);
}
/// Of four edges, given each one's ends.
template <class Quads, class Ends>
FourDoubles square_lengths(const Quads* at, const Ends& ends) {
  std::array<FourDoubles, 4> squares;
  for (std::size_t k = 0; k < 4; ++k) {
    const FourDoubles along = at[ends[k][0]].v - at[ends[k][1]].v;
    squares[k] = along * along;
  }
  return sums(squares[0], squares[1], squares[2], squares[3]);
}
bool any(const FourWords& mask) {
  return ((mask[0] | mask[1]) | (mask[2] | mask[3])) != 0;
}
/// The nearest whole numbers, of lanes below 2^31 in size.
LaneVector rounded(const FourDoubles& v) {
  const FourDoubles shifted = v + rounding_shift;
  const auto words = std::bit_cast<FourWords>(shifted);
  return LaneVector{static_cast<std::uint32_t>(words[0]), static_cast<std::uint32_t>(words[1]),
                    static_cast<std::uint32_t>(words[2]), static_cast<std::uint32_t>(words[3])};
}
FourDoubles as_doubles(LaneVector lanes) {
  const auto whole = std::bit_cast<SignedLaneVector>(lanes);
  return FourDoubles{static_cast<double>(whole[0]), static_cast<double>(whole[1]), static_cast<double>(whole[2]),
                     static_cast<double>(whole[3])};
}

/// base^(exponent / 65536).
double power(double base, std::uint32_t exponent_65536ths) {
  double result = 1.0;
  for (std::uint32_t i = 0; i < exponent_65536ths >> 16; ++i) result *= base;
  double root = base;
  for (std::uint32_t bits = exponent_65536ths << 16; bits != 0; bits <<= 1) {
    root = std::sqrt(root);
    if ((bits >> 31) != 0) result *= root;
  }
  return result;
}

bool all_within(std::span<const double> values, double least) {
  return std::ranges::all_of(values, [least](double value) { return std::isfinite(value) && value >= least; });
}
bool none_below_zero(const std::vector<float>& values) {
  return std::ranges::all_of(values, [](float value) { return std::isfinite(value) && value >= 0.0F; });
}
bool all_finite(std::span<const double> values) {
  return all_within(values, std::numeric_limits<double>::lowest());
}
double largest(const std::vector<float>& values) {
  return values.empty() ? 0.0 : static_cast<double>(*std::ranges::max_element(values));
}
/// Of a list of one for all, too.
double entry(const std::vector<float>& values, std::size_t i) {
  return static_cast<double>(values[values.size() == 1 ? 0 : i]);
}
bool has_one_or(std::size_t count, const std::vector<float>& values) {
  return values.size() == 1 || values.size() == count;
}

// No gas has more than 5/3; each whole one is a product more.
constexpr std::uint32_t exponent_max = 16 << 16;

/// The mechanics in steps of the grid a substep, and masses, but for what each spring and plane has.
struct Units {
  double square_s2;
  double damping;
  double gas_pressure;
  double outside;
  double six_gas_volumes;
  std::array<double, 3> gravity;
};

Units units_of(const Mechanics& mechanics, double grid_step_m) {
  const double substep_s = mechanics.frame_s / static_cast<double>(mechanics.substeps);
  const double square_s2 = substep_s * substep_s;
  const double area_factor = grid_step_m * square_s2 / 6.0;
  Units units{};
  units.square_s2 = square_s2;
  units.damping = mechanics.damping_n_s_m * substep_s;
  units.gas_pressure = mechanics.gas.pressure_pa * area_factor;
  units.outside = mechanics.gas.outside_pa * area_factor;
  units.six_gas_volumes = 6.0 * mechanics.gas.volume_m3 / (grid_step_m * grid_step_m * grid_step_m);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    units.gravity[axis] = mechanics.gravity_m_s2[axis] * square_s2 / grid_step_m;
  }
  return units;
}

/// The edges that each slot is an end of.
class SpringsOfSlots {
 public:
  SpringsOfSlots(const std::vector<std::array<std::uint32_t, 2>>& edges, std::size_t slots)
      : ends_(slots + 1), springs_(2 * edges.size()) {
    for (const auto& edge : edges) {
      for (const std::uint32_t slot : edge) ++ends_[slot + 1];
    }
    for (std::size_t slot = 0; slot < slots; ++slot) ends_[slot + 1] += ends_[slot];
    std::vector<std::size_t> next = ends_;
    for (std::uint32_t spring = 0; spring < edges.size(); ++spring) {
      for (const std::uint32_t slot : edges[spring]) springs_[next[slot]++] = spring;
    }
  }
  [[nodiscard]] std::span<const std::uint32_t> operator[](std::size_t slot) const {
    return std::span(springs_).subspan(ends_[slot], ends_[slot + 1] - ends_[slot]);
  }

 private:
  std::vector<std::size_t> ends_;
  std::vector<std::uint32_t> springs_;
};

}  // namespace

std::vector<std::array<std::uint32_t, 2>> spring_edges(const MeshOrder& order) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (std::uint32_t slot = 0; slot < order.size(); ++slot) {
    for (const std::uint32_t neighbour : order.rings[slot]) {
      if (neighbour > slot) edges.push_back({slot, neighbour});
    }
    for (std::uint32_t i = order.ring_rest_begins[slot]; i < order.ring_rest_begins[slot + 1]; ++i) {
      if (order.ring_rests[i] > slot) edges.push_back({slot, order.ring_rests[i]});
    }
  }
  return edges;
}

base::Status SimulatedMotion::check(const MeshOrder& order, const Mechanics& mechanics, double grid_step_m) {
  const std::size_t edges = spring_edges(order).size();
  if (!(mechanics.frame_s > 0.0) || !std::isfinite(mechanics.frame_s)) {
    return base::invalid("must be finite and more than 0", "frame_s");
  }
  if (mechanics.substeps == 0 || mechanics.substeps > simulated_substeps_max) {
    return base::invalid("must be 1 to " + std::to_string(simulated_substeps_max), "substeps");
  }
  if (!has_one_or(order.size(), mechanics.masses_kg) || !none_below_zero(mechanics.masses_kg)) {
    return base::invalid("must be one a vertex or one for all, none below 0", "masses_kg");
  }
  if (mechanics.rest_lengths_m.size() != edges || !none_below_zero(mechanics.rest_lengths_m)) {
    return base::invalid("must be one an edge, none below 0", "rest_lengths_m");
  }
  if (!has_one_or(edges, mechanics.stiffnesses_n_m) || !none_below_zero(mechanics.stiffnesses_n_m)) {
    return base::invalid("must be one an edge or one for all, none below 0", "stiffnesses_n_m");
  }
  if (!all_within(std::array{mechanics.damping_n_s_m}, 0.0)) {
    return base::invalid("must be finite and not below 0", "damping_n_s_m");
  }
  const Mechanics::Gas& gas = mechanics.gas;
  if (!all_within(std::array{gas.pressure_pa, gas.volume_m3, gas.outside_pa}, 0.0) || gas.volume_m3 == 0.0 ||
      gas.exponent_65536ths > exponent_max) {
    return base::invalid("must be finite, not below 0, its volume more than 0, its exponent at most 16", "gas");
  }
  if (!all_finite(mechanics.gravity_m_s2)) return base::invalid("must be finite", "gravity_m_s2");
  if (mechanics.planes.size() > simulated_planes_max) {
    return base::invalid("more than " + std::to_string(simulated_planes_max), "planes");
  }
  for (const Mechanics::Plane& plane : mechanics.planes) {
    const bool is_normal = std::ranges::all_of(plane.normal, [](double c) { return c >= -1.0 && c <= 1.0; });
    if (!is_normal || !all_finite(std::array{plane.offset_m / grid_step_m}) ||
        !all_within(std::array{plane.restitution, plane.friction}, 0.0)) {
      return base::invalid("must be finite, with a normal of length 1", "planes");
    }
  }
  const Units units = units_of(mechanics, grid_step_m);
  // Of the largest ones, which no spring's own are past.
  const double stiffness = largest(mechanics.stiffnesses_n_m) * units.square_s2;
  const double tension = stiffness * (largest(mechanics.rest_lengths_m) / grid_step_m);
  if (!all_finite(
          std::array{stiffness, tension, units.damping, units.gas_pressure, units.outside, units.six_gas_volumes}) ||
      !all_finite(units.gravity)) {
    return base::invalid("too large in steps of the grid", "frame_s");
  }
  return {};
}

SimulatedMotion::SimulatedMotion(std::shared_ptr<const MeshOrder> order, std::span<const std::uint32_t> indices,
                                 const Mechanics& mechanics, double grid_step_m)
    : order_(std::move(order)), substeps_(mechanics.substeps) {
  assert(check(*order_, mechanics, grid_step_m).ok());
  const std::size_t count = order_->size();
  const Units units = units_of(mechanics, grid_step_m);
  damping_ = units.damping;
  gas_pressure_ = units.gas_pressure;
  outside_ = units.outside;
  gas_exponent_ = mechanics.gas.exponent_65536ths;
  six_gas_volumes_ = units.six_gas_volumes;
  for (std::size_t axis = 0; axis < 3; ++axis) gravity_.v[axis] = units.gravity[axis];
  for (const Mechanics::Plane& plane : mechanics.planes) {
    const FourDoubles normal{plane.normal[0], plane.normal[1], plane.normal[2], 0.0};
    planes_.push_back({{normal}, {normal}, plane.offset_m / grid_step_m, plane.restitution, plane.friction});
  }

  std::vector<std::uint32_t> slots(count);
  inertias_.resize(count);
  for (std::uint32_t slot = 0; slot < count; ++slot) {
    const std::uint32_t vertex = order_->vertices[slot];
    slots[vertex] = slot;
    const double mass_kg = entry(mechanics.masses_kg, vertex);
    if (mass_kg > 0.0) inertias_[slot] = {1.0 / mass_kg, 1.0};
  }
  faces_.resize(indices.size() / 3);
  for (std::size_t i = 0; i < indices.size(); ++i) faces_[i / 3][i % 3] = slots[indices[i]];

  const auto edges = spring_edges(*order_);
  springs_.resize(edges.size() / 4 + 1);  // the last one of all pulls at nothing
  for (std::size_t i = 0; i < edges.size(); ++i) {
    Springs& four = springs_[i / 4];
    four.ends[i % 4] = edges[i];
    four.stiffness.v[i % 4] = entry(mechanics.stiffnesses_n_m, i) * units.square_s2;
    four.tension_at_rest.v[i % 4] = four.stiffness.v[i % 4] * (entry(mechanics.rest_lengths_m, i) / grid_step_m);
  }
  pulls_.resize(4 * springs_.size());
  const auto none = static_cast<std::uint32_t>(pulls_.size() - 1);
  const SpringsOfSlots springs_of(edges, count);
  std::vector<std::uint32_t> spring_to(count, none);  // each neighbour of the slot at hand
  ring_springs_.resize(count);
  for (std::uint32_t slot = 0; slot < count; ++slot) {
    for (const std::uint32_t spring : springs_of[slot]) {
      spring_to[edges[spring][0] == slot ? edges[spring][1] : edges[spring][0]] = spring;
    }
    spring_to[slot] = none;
    for (std::size_t k = 0; k < 6; ++k) ring_springs_[slot].first[k] = spring_to[order_->rings[slot][k]];
    for (std::uint32_t i = order_->ring_rest_begins[slot]; i < order_->ring_rest_begins[slot + 1]; ++i) {
      rest_springs_.push_back(spring_to[order_->ring_rests[i]]);
    }
  }
  for (auto* quads : {&start_, &positions_, &steps_, &gradient_, &next_}) quads->resize(count);
}

void SimulatedMotion::begin_frame(std::span<const std::int64_t> points, const std::vector<Lanes>& velocities) {
  const double share = velocity_unit / substeps_;
  for (std::size_t slot = 0; slot < start_.size(); ++slot) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto from_first =
          static_cast<std::uint64_t>(points[3 * slot + axis]) - static_cast<std::uint64_t>(points[axis]);
      start_[slot].v[axis] = static_cast<double>(static_cast<std::int64_t>(from_first));
      steps_[slot].v[axis] = static_cast<double>(static_cast<std::int32_t>(velocities[slot].v[axis])) * share;
    }
    start_[slot].v[3] = 1.0;
    steps_[slot].v[3] = 0.0;
    positions_[slot] = start_[slot];
  }
}

/// Takes the planes that the body may reach in the frame.
void SimulatedMotion::place_planes(std::span<const std::int64_t> points) {
  near_planes_.clear();
  if (planes_.empty()) return;
  double fastest = 0.0;
  for (const Quad& step : steps_) fastest = std::max(fastest, sum(step.v * step.v));
  const double falling = std::sqrt(sum(gravity_.v * gravity_.v)) * substeps_;
  const double way = reach * substeps_ * (std::sqrt(fastest) + falling);
  for (Plane plane : planes_) {
    const FourDoubles origin{static_cast<double>(points[0]), static_cast<double>(points[1]),
                             static_cast<double>(points[2]), 0.0};
    plane.equation.v[3] = sum(plane.normal.v * origin) - plane.offset;
    double lowest = way;
    for (const Quad& position : start_) lowest = std::min(lowest, sum(plane.equation.v * position.v));
    if (lowest < way) near_planes_.push_back(plane);
  }
}

PNEUMA_CLONED void SimulatedMotion::measure_edges() {
  const Quad* const at = start_.data();
  for (Springs& four : springs_) {
    const FourDoubles square = square_lengths(at, four.ends);
    for (std::size_t k = 0; k < 4; ++k) {
      four.length.v[k] = std::sqrt(square[k]);
      four.inverse_length.v[k] = 1.0 / four.length.v[k];
    }
    const FourDoubles none = all(0.0);
    four.inverse_length.v = square >= square_length_min ? four.inverse_length.v : none;
  }
}

/// Sets what each spring pulls with, over its length. The inverse lengths follow by one step of Newton's method a
/// substep, which they change little in: a division and a square root would take longer than all the rest.
PNEUMA_CLONED void SimulatedMotion::pull_edges(double damping) {
  const Quad* const at = positions_.data();
  double* pulls = pulls_.data();
  for (Springs& four : springs_) {
    const FourDoubles square = square_lengths(at, four.ends);
    const FourDoubles last = four.inverse_length.v;
    const FourDoubles two = all(2.0);
    FourDoubles product = square * last * last;
    product = product < two ? product : two;
    const FourDoubles inverse = last * (1.5 - 0.5 * product);
    const FourDoubles length = square * inverse;
    const FourDoubles pull =
        four.stiffness.v - four.tension_at_rest.v * inverse + damping * (length - four.length.v) * inverse;
    four.inverse_length.v = inverse;
    four.length.v = length;
    for (std::size_t k = 0; k < 4; ++k) pulls[k] = pull[k];
    pulls += 4;
  }
}

/// Sets the volume's gradient (six times it) to that half a substep from now, the middle of the two substeps that it is
/// used in, and the sums that the volume is found by: it is taken to be linear around there.
PNEUMA_CLONED void SimulatedMotion::find_gradient() {
  const std::size_t count = positions_.size();
  for (std::size_t slot = 0; slot < count; ++slot) {
    next_[slot].v = positions_[slot].v + 0.5 * steps_[slot].v;
    gradient_[slot] = {};
  }
  const Quad* const at = next_.data();
  Quad* const out = gradient_.data();
  for (const auto& [a, b, c] : faces_) {
    const FourDoubles normal = cross(at[b].v - at[a].v, at[c].v - at[a].v);
    out[a].v += normal;
    out[b].v += normal;
    out[c].v += normal;
  }
  FourDoubles here = all(0.0);
  FourDoubles middle = all(0.0);
  for (std::size_t slot = 0; slot < count; ++slot) {
    here += out[slot].v * positions_[slot].v;
    middle += out[slot].v * at[slot].v;
  }
  volume_sums_.v = here;
  volume_base_ = sum(middle) * (2.0 / 3.0);
}

double SimulatedMotion::pressure_factor() const {
  const double six_volumes = sum(volume_sums_.v) - volume_base_;
  const double least = six_gas_volumes_ * volume_share_min;
  const double within = six_volumes > least ? six_volumes : least;
  return gas_pressure_ * power(six_gas_volumes_ / within, gas_exponent_) - outside_;
}

/// One substep from its middle to the next one's; `ahead` is 0 in the last one, which ends at its end.
PNEUMA_CLONED void SimulatedMotion::move_vertices(double pressure, double ahead) {
  const MeshOrder& order = *order_;
  const double* const pulls = pulls_.data();
  const Quad* const from = positions_.data();
  const Quad* const gradient = gradient_.data();
  Quad* const to = next_.data();
  FourDoubles volume = all(0.0);
  for (std::size_t slot = 0; slot < order.size(); ++slot) {
    const auto& ring = order.rings[slot];
    const auto& springs = ring_springs_[slot].first;
    FourDoubles pulled = pulls[springs[0]] * from[ring[0]].v;
    for (std::size_t k = 1; k < ring.size(); ++k) pulled += pulls[springs[k]] * from[ring[k]].v;
    for (std::uint32_t i = order.ring_rest_begins[slot]; i < order.ring_rest_begins[slot + 1]; ++i) {
      pulled += pulls[rest_springs_[i]] * from[order.ring_rests[i]].v;
    }
    const FourDoubles at = from[slot].v;
    const FourDoubles force =
        pulled - __builtin_shufflevector(pulled, pulled, 3, 3, 3, 3) * at + pressure * gradient[slot].v;
    const Inertia& inertia = inertias_[slot];
    FourDoubles step = steps_[slot].v + (inertia.inverse_mass * force + inertia.falls * gravity_.v);
    FourDoubles end = at + 0.5 * step;
    for (const Plane& plane : near_planes_) {
      const double distance = sum(plane.equation.v * end);
      if (!(distance < 0.0)) continue;
      end -= distance * plane.normal.v;
      const double inward = sum(plane.normal.v * step);
      if (!(inward < 0.0)) continue;
      const FourDoubles along = step - inward * plane.normal.v;
      const double bounce = -(1.0 + plane.restitution) * inward;
      const double speed = std::sqrt(sum(along * along));
      const double rubbed = plane.friction * bounce;
      const double kept = rubbed < speed ? 1.0 - rubbed / speed : 0.0;
      step = kept * along + (inward + bounce) * plane.normal.v;
    }
    to[slot].v = end + ahead * step;
    steps_[slot].v = step;
    volume += gradient[slot].v * to[slot].v;
  }
  volume_sums_.v = volume;
  std::swap(positions_, next_);
}

/// False where the body has left the numbers: nothing is set then.
bool SimulatedMotion::end_frame(std::vector<Lanes>& drift) {
  bool is_within = true;
  for (std::size_t slot = 0; slot < start_.size(); ++slot) {
    const FourDoubles moved = positions_[slot].v - start_[slot].v;
    const FourDoubles speed = substeps_ * steps_[slot].v;
    const FourDoubles most = all(steps_a_frame_max);
    is_within &= !any(~((moved < most) & (moved > -most) & (speed < most) & (speed > -most)));
    drift[slot].v = rounded(16.0 * moved);
    next_[slot].v = moved;
  }
  return is_within;
}

void SimulatedMotion::predict(std::span<const std::int64_t> points, const std::vector<Lanes>& velocities,
                              std::vector<Lanes>& drift) {
  assert(points.size() == 3 * order_->size() && velocities.size() == order_->size());
  drift.resize(order_->size());
  if (drift.empty()) return;
  begin_frame(points, velocities);
  place_planes(points);
  measure_edges();
  for (std::size_t slot = 0; slot < positions_.size(); ++slot) positions_[slot].v += 0.5 * steps_[slot].v;
  const auto substeps = static_cast<std::uint32_t>(substeps_);
  for (std::uint32_t substep = 0; substep < substeps; ++substep) {
    // Lengths a whole substep apart give the rate of the damping, but the first one, of half a substep.
    pull_edges(substep == 0 ? 2.0 * damping_ : damping_);
    if (substep % 2 == 0) find_gradient();
    move_vertices(pressure_factor(), substep + 1 < substeps ? 0.5 : 0.0);
  }
  if (end_frame(drift)) return;
  const double share = velocity_unit / substeps_;
  for (std::size_t slot = 0; slot < drift.size(); ++slot) {
    const FourDoubles velocity = as_doubles(velocities[slot].v);
    drift[slot].v = velocities[slot].v << 1;
    next_[slot].v = velocity * velocity_unit;
    steps_[slot].v = velocity * share;
  }
}

void take_for_velocities(const std::vector<Lanes>& moves, std::vector<Lanes>& velocities) {
  constexpr auto most = static_cast<std::int32_t>(steps_a_frame_max);
  constexpr auto units_a_step = static_cast<std::int32_t>(1.0 / velocity_unit);
  velocities.resize(moves.size());
  for (std::size_t slot = 0; slot < moves.size(); ++slot) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto move = static_cast<std::int32_t>(moves[slot].v[axis]);
      velocities[slot].v[axis] = static_cast<std::uint32_t>(units_a_step * std::clamp(move, -most, most));
    }
  }
}

void SimulatedMotion::correct(const std::vector<Lanes>& moves, std::vector<Lanes>& velocities) const {
  velocities.resize(moves.size());
  constexpr FourDoubles units{1.0 / velocity_unit, 1.0 / velocity_unit, 1.0 / velocity_unit, 0.0};
  for (std::size_t slot = 0; slot < moves.size(); ++slot) {
    const FourDoubles missed = as_doubles(moves[slot].v) - next_[slot].v;
    FourDoubles velocity = (substeps_ * steps_[slot].v + velocity_gain * missed) * units;
    const FourDoubles most = all(velocity_max);
    velocity = velocity < most ? velocity : most;
    velocity = velocity > -most ? velocity : -most;
    velocities[slot].v = rounded(velocity);
  }
}

}  // namespace pneuma::codec
