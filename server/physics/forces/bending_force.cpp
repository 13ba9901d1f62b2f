#include "physics/forces/bending_force.h"

#include <cmath>

namespace pneuma::physics {
namespace {

std::array<Vec3d, 4> corners_of(const Hinge& hinge, std::span<const Vec3d> x) {
  std::array<Vec3d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = x[hinge.vertices[i]];
  return corners;
}

}  // namespace

template <class Real>
void BendingForce::add(SoftState<Real>& body, const ForcePlace<Real>& at, std::span<Vec3<Real>> force) {
  const StageTimer timer(at.profile, Stage::bending);
  add_bending<Real>(body.hinges, body.body.springs.bend_stiffness_n_m, at.x, force);
}

template <class Real>
double BendingForce::potential_j(const SoftState<Real>& body, const EnergyPlace& at, const Surroundings&) {
  return bending_energy_j(body.hinges, body.body.springs.bend_stiffness_n_m, at.x);
}

template <class Real>
void BendingForce::linearise(const SoftState<Real>& body, const TangentPlace& at, Tangents& tangents) {
  for (const Hinge& hinge : body.hinges) {
    const auto angle = hinge_angle(corners_of(hinge, at.x));
    if (!angle) continue;
    tangents.four_points.push_back(
        {hinge.vertices, angle->gradient, at.s * at.s * body.body.springs.bend_stiffness_n_m * hinge.weight});
  }
}

template <class Real>
void BendingForce::stiffen(const SoftState<Real>& body, const Bound& bound, const MatrixPlace& at,
                           MatrixEntries& entries) {
  for (const Hinge& hinge : body.hinges) {
    // At rest all four gradients are near one line: their lengths, with signs, are the row of a Laplacian.
    const auto angle = hinge_angle(corners_of(hinge, at.mesh.positions_m));
    if (!angle) continue;
    const double stiffness = at.s * at.s * bound.bend_stiffness_n_m * hinge.weight;
    std::array<double, 4> lengths{};
    for (std::size_t i = 0; i < 4; ++i) {
      lengths[i] = std::copysign(angle->gradient[i].norm(), angle->gradient[i].dot(angle->gradient[2]));
    }
    lengths[0] = -(lengths[1] + lengths[2] + lengths[3]);  // a move of the whole is none
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        entries.add(hinge.vertices[i], hinge.vertices[j], stiffness * lengths[i] * lengths[j]);
      }
    }
  }
}

void BendingForce::add_to_skin(const Mesh& mesh, const Springs& springs, SkinMotion& skin) {
  if (!(springs.bend_stiffness_n_m > 0.0)) return;
  for (const Hinge& hinge : make_hinges(mesh)) {
    if (const auto angle = hinge_angle(corners_of(hinge, mesh.positions_m))) {
      skin.undamped_bends.push_back({hinge.vertices, angle->gradient, springs.bend_stiffness_n_m * hinge.weight});
    }
  }
}

template <class Real>
void BendingForce::Xpbd<Real>::pass(const XpbdPlace<Real>& place, XpbdWay way) {
  if (turns.empty()) return;
  const StageTimer timer(place.profile, Stage::bending);
  SoftState<Real>& body = place.body;
  go_over(turns.size(), way, [&](std::size_t index) {
    const Hinge& hinge = body.hinges[index];
    std::array<Vec3d, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::uint32_t vertex = hinge.vertices[i];
      corners[i] = (body.x[vertex] + body.dr[vertex]).template cast<double>();
    }
    const auto angle = hinge_angle(corners);
    if (!angle) return;
    double give = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      give += static_cast<double>(place.inverse_masses_1_kg[hinge.vertices[i]]) * angle->gradient[i].squaredNorm();
    }
    const double share = place.h_s * place.h_s * body.body.springs.bend_stiffness_n_m * hinge.weight;
    double& turn = turns[index];
    const double more = (share * bend_rad(hinge, *angle) - turn) / (1.0 + share * give);
    turn += more;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::uint32_t vertex = hinge.vertices[i];
      body.dr[vertex] -= place.inverse_masses_1_kg[vertex] * (more * angle->gradient[i]).template cast<Real>();
    }
  });
}

template struct BendingForce::Xpbd<float>;
template struct BendingForce::Xpbd<double>;
#define PNEUMA_INSTANTIATE(Real)                                                                              \
  template void BendingForce::add(SoftState<Real>&, const ForcePlace<Real>&, std::span<Vec3<Real>>);          \
  template double BendingForce::potential_j(const SoftState<Real>&, const EnergyPlace&, const Surroundings&); \
  template void BendingForce::linearise(const SoftState<Real>&, const TangentPlace&, Tangents&);              \
  template void BendingForce::stiffen(const SoftState<Real>&, const Bound&, const MatrixPlace&, MatrixEntries&);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
