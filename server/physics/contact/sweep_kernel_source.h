// The one source of the sweep kernels. Include only where PNEUMA_LANES names the instruction set that the file is
// compiled for, as with lane_pack.h. No fused multiply-add: a processor without one would take many times as long.
#pragma once

#include <cmath>
#include <cstddef>

#include "physics/contact/sweep_kernels.h"
#include "physics/lanes/lane_pack.h"

namespace pneuma::physics {
inline namespace PNEUMA_LANES {

template <class P>
double sum_of_three(const P& vector) {
  double numbers[4];
  vector.store(numbers);
  return numbers[0] + numbers[1] + numbers[2];
}

template <class P>
P value_of(const LumpedRow& row, const double* values) {
  const auto corner = [&](std::size_t i) {
    return P::all(row.weights[i]) * P::load(values + std::size_t{4} * row.corners[i]);
  };
  const P first = corner(0) + corner(1);
  return row.corner_count == 2 ? first : first + (corner(2) + corner(3));
}

template <class P>
void project_rows(const LumpedRow* rows, std::size_t count, const double* values, double* along) {
  for (std::size_t i = 0; i < count; ++i) {
    along[i] = sum_of_three(P::load(rows[i].normal) * value_of<P>(rows[i], values));
  }
}

// Block Gauss-Seidel: along the normal first, then across it, within Coulomb's cone.
template <class P>
double sweep_rows(const RowSweep& sweep) {
  double largest_m2_s2 = 0.0;
  for (std::size_t k = 0; k < sweep.count; ++k) {
    const LumpedRow& row = sweep.rows[sweep.which[k]];
    LumpedImpulse& impulse = sweep.impulses[sweep.which[k]];
    const P normal = P::load(row.normal);
    const P value = value_of<P>(row, sweep.values);
    const double approach_m_s = sum_of_three(normal * value);
    const double wanted_n_s = impulse.pressed_n_s + (impulse.least_m_s - approach_m_s) * row.mass_kg;
    const double pressed_n_s = wanted_n_s > 0.0 ? wanted_n_s : 0.0;
    if (pressed_n_s == 0.0 && impulse.pressed_n_s == 0.0) continue;
    P change_n_s = P::all(pressed_n_s - impulse.pressed_n_s) * normal;
    if (sweep.with_friction && row.friction > 0.0) {
      const P before_n_s = P::load(impulse.rubbed_n_s);
      const P slip = value - P::all(approach_m_s) * normal;
      P rubbed_n_s = before_n_s - P::all(row.mass_kg) * slip;
      const double most_n_s = row.friction * pressed_n_s;
      const double rubbed_n2_s2 = sum_of_three(rubbed_n_s * rubbed_n_s);
      if (rubbed_n2_s2 > most_n_s * most_n_s) rubbed_n_s = P::all(most_n_s / std::sqrt(rubbed_n2_s2)) * rubbed_n_s;
      rubbed_n_s.store(impulse.rubbed_n_s);
      change_n_s = change_n_s + (rubbed_n_s - before_n_s);
    }
    impulse.pressed_n_s = pressed_n_s;
    for (std::size_t i = 0; i < row.pushed_count; ++i) {
      double* at = sweep.values + std::size_t{4} * row.corners[i];
      (P::load(at) + P::all(row.pushes_1_kg[i]) * change_n_s).store(at);
    }
    const double changed_m2_s2 = sum_of_three(change_n_s * change_n_s) / (row.mass_kg * row.mass_kg);
    largest_m2_s2 = changed_m2_s2 > largest_m2_s2 ? changed_m2_s2 : largest_m2_s2;
  }
  return largest_m2_s2;
}

template <class P>
consteval SweepKernels list_sweep_kernels() {
  return {&project_rows<P>, &sweep_rows<P>};
}

}  // namespace PNEUMA_LANES
}  // namespace pneuma::physics
