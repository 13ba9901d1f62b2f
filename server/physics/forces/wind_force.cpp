#include "physics/forces/wind_force.h"

#include <algorithm>
#include <cmath>

namespace pneuma::physics {
namespace {

// A third of the faces around each vertex, at rest.
std::vector<double> vertex_areas_m2(const Mesh& mesh) {
  std::vector<double> areas_m2(mesh.positions_m.size(), 0.0);
  for (const auto& [a, b, c] : mesh.faces) {
    const std::vector<Vec3d>& x = mesh.positions_m;
    const double share_m2 = (x[b] - x[a]).cross(x[c] - x[a]).norm() / 6.0;
    for (const std::uint32_t vertex : {a, b, c}) areas_m2[vertex] += share_m2;
  }
  return areas_m2;
}

}  // namespace

// A flat plate in an air stream: 1/2 rho C A u|u|, split into the part along the face's normal and the part along the
// face.
template <class Real>
void WindForce::add(SoftState<Real>& state, const ForcePlace<Real>& at, std::span<Vec3<Real>> force) {
  const StageTimer timer(at.profile, Stage::wind);
  const SoftBody& body = state.body;
  const Atmosphere& atmosphere = at.surroundings.atmosphere;
  const std::span<const Vec3<Real>> x = at.x;
  const std::span<const Vec3<Real>> v = at.v;
  const auto half_density = static_cast<Real>(0.5 * atmosphere.density_kg_m3);
  const auto drag_normal = static_cast<Real>(body.drag.normal);
  const auto drag_tangential = static_cast<Real>(body.drag.tangential);
  const Vec3<Real> wind = atmosphere.wind.cast<Real>();
  for (const Face& face : body.mesh->faces) {
    const auto [a, b, c] = face;
    const Vec3<Real> cross = (x[b] - x[a]).cross(x[c] - x[a]);
    const Real twice_area = cross.norm();
    if (!(twice_area > 0)) continue;
    const Vec3<Real> normal = cross / twice_area;
    const Vec3<Real> stream = wind - (v[a] + v[b] + v[c]) / Real{3};
    const Real through = stream.dot(normal);
    const Vec3<Real> along = stream - through * normal;
    const Vec3<Real> share =
        (half_density * twice_area / Real{6}) *
        (drag_normal * std::abs(through) * through * normal + drag_tangential * along.norm() * along);
    force[a] += share;
    force[b] += share;
    force[c] += share;
  }
}

// d/dv of 1/2 rho A (C_n |u.n| u.n n + C_t |u_t| u_t), shared by thirds as the force is, of the mean of three speeds.
template <class Real>
void WindForce::linearise(const SoftState<Real>& state, const TangentPlace& at, Tangents& tangents) {
  if (!is_present(state, at.surroundings)) return;
  const SoftBody& body = state.body;
  const Atmosphere& atmosphere = at.surroundings.atmosphere;
  const std::span<const Vec3d> x = at.x;
  const std::span<const Vec3d> v = at.v;
  tangents.faces.resize(body.mesh->faces.size(), Eigen::Matrix3d::Zero());
  for (std::size_t i = 0; i < tangents.faces.size(); ++i) {
    const auto [a, b, c] = body.mesh->faces[i];
    const Vec3d cross = (x[b] - x[a]).cross(x[c] - x[a]);
    const double twice_area = cross.norm();
    if (!(twice_area > 0.0)) continue;
    const Vec3d normal = cross / twice_area;
    const Vec3d stream = atmosphere.wind - (v[a] + v[b] + v[c]) / 3.0;
    const double through = stream.dot(normal);
    const Vec3d along = stream - through * normal;
    const double speed_along = along.norm();
    Eigen::Matrix3d drag = 2.0 * body.drag.normal * std::abs(through) * normal * normal.transpose();
    if (speed_along > 0.0) {
      drag += body.drag.tangential * (speed_along * (Eigen::Matrix3d::Identity() - normal * normal.transpose()) +
                                      along * along.transpose() / speed_along);
    }
    tangents.faces[i] += at.s * 0.5 * atmosphere.density_kg_m3 * 0.5 * twice_area / 9.0 * drag;
  }
}

template <class Real>
WindForce::Bound WindForce::bound(const SoftState<Real>& body, const Surroundings& surroundings) {
  if (!is_present(body, surroundings)) return {};
  const Atmosphere& atmosphere = surroundings.atmosphere;
  double squared_max = 1.0;
  for (const Vec3<Real>& v : body.v) squared_max = std::max(squared_max, static_cast<double>(v.squaredNorm()));
  int exponent = 0;
  const bool is_power = std::frexp(squared_max, &exponent) == 0.5;
  const double speed_m_s = atmosphere.wind.norm() + std::ldexp(1.0, (is_power ? exponent : exponent + 1) / 2);
  return {atmosphere.density_kg_m3 * std::max(body.body.drag.normal, body.body.drag.tangential) * speed_m_s};
}

template <class Real>
void WindForce::stiffen(const SoftState<Real>&, const Bound& bound, const MatrixPlace& at, MatrixEntries& entries) {
  if (!(bound.drag_n_s_m3 > 0.0)) return;
  const std::vector<double> areas_m2 = vertex_areas_m2(at.mesh);
  for (std::uint32_t i = 0; i < areas_m2.size(); ++i) entries.add(i, i, at.s * bound.drag_n_s_m3 * areas_m2[i]);
}

template <class Real>
void WindForce::Xpbd<Real>::push(const XpbdPlace<Real>& place, std::span<Vec3<Real>> velocities_m_s) {
  SoftState<Real>& body = place.body;
  if (!is_present(body, place.surroundings)) return;
  forces_n.assign(body.x.size(), Vec3<Real>::Zero());
  add<Real>(body, {.x = body.x, .v = body.v, .surroundings = place.surroundings}, forces_n);
  const auto h = static_cast<Real>(place.h_s);
  const Vec3<Real> wind = place.surroundings.atmosphere.wind.template cast<Real>();
  for (std::size_t i = 0; i < body.x.size(); ++i) {
    Vec3<Real> push = h * place.inverse_masses_1_kg[i] * forces_n[i];
    const Real behind = (wind - body.v[i]).norm();
    const Real length = push.norm();
    if (length > behind) push *= behind / length;
    velocities_m_s[i] += push;
  }
}

template struct WindForce::Xpbd<float>;
template struct WindForce::Xpbd<double>;
#define PNEUMA_INSTANTIATE(Real)                                                                  \
  template void WindForce::add(SoftState<Real>&, const ForcePlace<Real>&, std::span<Vec3<Real>>); \
  template void WindForce::linearise(const SoftState<Real>&, const TangentPlace&, Tangents&);     \
  template WindForce::Bound WindForce::bound(const SoftState<Real>&, const Surroundings&);        \
  template void WindForce::stiffen(const SoftState<Real>&, const Bound&, const MatrixPlace&, MatrixEntries&);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
