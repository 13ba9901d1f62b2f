// How far a body's vertices reach in a substep.
#pragma once

#include <cstddef>
#include <limits>

namespace pneuma::physics {

/// The least and the most of some numbers; at first of none.
template <class Real>
struct Span {
  Real low = std::numeric_limits<Real>::infinity();
  Real high = -std::numeric_limits<Real>::infinity();

  void take(Real value) {
    low = value < low ? value : low;
    high = value > high ? value : high;
  }
};

/// By axis, in the body's own coordinates. What is no number is left out, and then the body is not finite.
template <class Real>
struct Extents {
  Span<Real> x[3];     // where the substep finds the vertices, m
  Span<Real> end[3];   // x and the move, m
  Span<Real> move[3];  // m
  Real v_max_m_s = 0;  // the largest component of a velocity
  bool finite = true;  // all of them
};

}  // namespace pneuma::physics
