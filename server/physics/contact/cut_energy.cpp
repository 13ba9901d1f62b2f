#include "physics/contact/cut_energy.h"

#include <vector>

#include "physics/mesh/hinge.h"

namespace pneuma::physics {

template <class Real>
double stretched_by_cuts_j(const SoftState<Real>& state, const SurfaceBody& body, std::span<const Vec3d> missed_m) {
  std::vector<Vec3d> ends_m(body.to.size());
  for (std::uint32_t k = 0; k < ends_m.size(); ++k) ends_m[k] = body.from[k] + body.cut_move_m(k);
  const Springs& springs = state.body.springs;
  const std::vector<Edge>& edges = state.body.mesh->edges;
  double sum_j = 0.0;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto [a, b] = edges[e];
    const Vec3d change_m = missed_m[a] - missed_m[b];
    if (change_m.isZero(0.0)) continue;
    const double rest_m = static_cast<double>(state.rest_length_m(e));
    const Vec3d edge_m = ends_m[a] - ends_m[b];
    const double cut_m = edge_m.norm() - rest_m;
    const double free_m = (edge_m + change_m).norm() - rest_m;
    sum_j += 0.5 * springs.stiffness_n_m * springs.stiffness_scale(edges[e]) * (cut_m * cut_m - free_m * free_m);
  }
  if (state.hinges.empty()) return sum_j;
  sum_j += bending_energy_j(state.hinges, springs.bend_stiffness_n_m, ends_m);
  for (std::size_t k = 0; k < ends_m.size(); ++k) ends_m[k] += missed_m[k];
  return sum_j - bending_energy_j(state.hinges, springs.bend_stiffness_n_m, ends_m);
}

template <class Real>
double kinetic_among_j(std::span<const SoftState<Real>> soft, std::span<const std::uint32_t> bodies) {
  double mass_kg = 0.0;
  Vec3d momentum_n_s = Vec3d::Zero();
  double all_j = 0.0;
  for (const std::uint32_t i : bodies) {
    for (std::size_t k = 0; k < soft[i].v.size(); ++k) {
      const Vec3d v = soft[i].v[k].template cast<double>();
      mass_kg += soft[i].mass_kg(k);
      momentum_n_s += soft[i].mass_kg(k) * v;
      all_j += 0.5 * soft[i].mass_kg(k) * v.squaredNorm();
    }
  }
  return all_j - 0.5 * momentum_n_s.squaredNorm() / mass_kg;
}

#define PNEUMA_INSTANTIATE(Real)                                                                           \
  template double stretched_by_cuts_j(const SoftState<Real>&, const SurfaceBody&, std::span<const Vec3d>); \
  template double kinetic_among_j(std::span<const SoftState<Real>>, std::span<const std::uint32_t>);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
