// The system kernels' one source. Include only where PNEUMA_LANES names the instruction set that the file is compiled
// for, as with lane_pack.h. No fused multiply-add: a processor without one would take many times as long.
#pragma once

#include "physics/implicit/system_kernels.h"
#include "physics/lanes/lane_pack.h"

namespace pneuma::physics {
inline namespace PNEUMA_LANES {

// P's width of edges at a time, each in a lane of its own; then one after the other goes into the vertices, so that
// every sum has the order of the edges.
template <class P>
void add_products_of(const EdgeTangent* tangents, const EdgePlaces* edges, const double* u, double* product) {
  constexpr std::size_t width = P::width;
  std::uint32_t firsts[width];
  std::uint32_t seconds[width];
  std::uint32_t steps[width];
  double alongs[width];
  double acrosses[width];
  for (std::size_t i = 0; i < width; ++i) {
    firsts[i] = 4 * edges[i].first;
    seconds[i] = 4 * edges[i].second;
    steps[i] = static_cast<std::uint32_t>(8 * i);
    alongs[i] = tangents[P::slot_of_lane(i)].along;
    acrosses[i] = tangents[P::slot_of_lane(i)].across;
  }
  const P along = P::load(alongs);
  const P across = P::load(acrosses);
  P x[3];
  P du[3];
  P n[3];
  P turn[3];
  P::gather(u, firsts, x[0], x[1], x[2]);
  P::gather(u, seconds, du[0], du[1], du[2]);
  for (std::size_t i = 0; i < 3; ++i) du[i] = du[i] - x[i];
  P::gather(tangents->direction, steps, n[0], n[1], n[2]);
  P::gather(tangents->turn, steps, turn[0], turn[1], turn[2]);
  const P stretch = (along - across) * (n[0] * du[0] + n[1] * du[1] + n[2] * du[2]);
  // -P grad^2 V: what an edge does to both its ends is one and the same, as the ring around a vertex closes.
  const P turned[3] = {du[1] * turn[2] - du[2] * turn[1], du[2] * turn[0] - du[0] * turn[2],
                       du[0] * turn[1] - du[1] * turn[0]};
  P to_first[3];
  P to_second[3];
  for (std::size_t i = 0; i < 3; ++i) {
    const P pull = stretch * n[i] + across * du[i];
    to_first[i] = pull + turned[i];
    to_second[i] = pull - turned[i];
  }
  double of_first[4 * width];
  double of_second[4 * width];
  P::store_rows(of_first, to_first[0], to_first[1], to_first[2]);
  P::store_rows(of_second, to_second[0], to_second[1], to_second[2]);
  using Row = Pack<double, 4>;
  for (std::size_t i = 0; i < width; ++i) {
    double* first = product + firsts[i];
    double* second = product + seconds[i];
    (Row::load(first) - Row::load(of_first + 4 * i)).store(first);
    (Row::load(second) + Row::load(of_second + 4 * i)).store(second);
  }
}

template <class P>
void add_edge_products(const EdgeTangent* tangents, const EdgePlaces* edges, std::size_t count, const MotionRow* u,
                       MotionRow* product) {
  std::size_t i = 0;
  for (; i + P::width <= count; i += P::width) {
    add_products_of<P>(tangents + i, edges + i, u->columns, product->columns);
  }
  if (i == count) return;
  EdgeTangent last[P::width] = {};  // those beyond the end pull at nothing
  EdgePlaces at[P::width] = {};
  for (std::size_t k = 0; i + k < count; ++k) {
    last[k] = tangents[i + k];
    at[k] = edges[i + k];
  }
  add_products_of<P>(last, at, u->columns, product->columns);
}

// Two rows at a time: eight sums, added in one order.
template <class P>
double dot_rows(const MotionRow* a, const MotionRow* b, std::size_t count) {
  P even = P::all(0.0);
  P odd = P::all(0.0);
  std::size_t i = 0;
  for (; i + 2 <= count; i += 2) {
    even = even + P::load(a[i].columns) * P::load(b[i].columns);
    odd = odd + P::load(a[i + 1].columns) * P::load(b[i + 1].columns);
  }
  if (i < count) even = even + P::load(a[i].columns) * P::load(b[i].columns);
  double sums[4];
  (even + odd).store(sums);
  return sums[0] + sums[1] + sums[2];
}

template <class P>
void scale_each_row(const double* diagonal, const MotionRow* u, std::size_t count, MotionRow* to) {
  for (std::size_t i = 0; i < count; ++i) (P::all(diagonal[i]) * P::load(u[i].columns)).store(to[i].columns);
}

template <class P>
void add_rows(double share, const MotionRow* x, std::size_t count, MotionRow* to) {
  const P scale = P::all(share);
  for (std::size_t i = 0; i < count; ++i) (P::load(to[i].columns) + scale * P::load(x[i].columns)).store(to[i].columns);
}

template <class P>
void add_to_rows(const MotionRow* x, double share, std::size_t count, MotionRow* to) {
  const P scale = P::all(share);
  for (std::size_t i = 0; i < count; ++i) (P::load(x[i].columns) + scale * P::load(to[i].columns)).store(to[i].columns);
}

template <class P>
consteval SystemKernels list_system_kernels() {
  return {&add_edge_products<P>, &dot_rows<P>, &scale_each_row<P>, &add_rows<P>, &add_to_rows<P>};
}

}  // namespace PNEUMA_LANES
}  // namespace pneuma::physics
