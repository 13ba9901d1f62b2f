#include "physics/forces/spring_force.h"

#include <algorithm>

namespace pneuma::physics {
namespace {

// Calls work(edge, stiffness_n_m) for each.
template <class Work>
void for_each_spring(const Mesh& mesh, const Springs& springs, double stiffness_n_m, const Work& work) {
  if (springs.vertex_stiffness_scale.empty()) {
    for (std::size_t e = 0; e < mesh.edges.size(); ++e) work(e, stiffness_n_m);
  } else {
    for (std::size_t e = 0; e < mesh.edges.size(); ++e) work(e, stiffness_n_m * springs.stiffness_scale(mesh.edges[e]));
  }
}

}  // namespace

template <class Real>
double SpringForce::potential_j(const SoftState<Real>& body, const EnergyPlace& at, const Surroundings&) {
  const Mesh& mesh = *body.body.mesh;
  const Springs& springs = body.body.springs;
  double sum_j = 0.0;
  for_each_spring(mesh, springs, springs.stiffness_n_m, [&](std::size_t e, double stiffness_n_m) {
    const double length_m = (at.x[mesh.edges[e][1]] - at.x[mesh.edges[e][0]]).norm();
    const double stretch_m = length_m - static_cast<double>(body.rest_length_m(e));
    sum_j += 0.5 * stiffness_n_m * stretch_m * stretch_m;
  });
  return sum_j;
}

template <class Real>
void SpringForce::linearise(const SoftState<Real>& body, const TangentPlace& at, Tangents& tangents) {
  const Mesh& mesh = *body.body.mesh;
  const Springs& springs = body.body.springs;
  const double damping = at.s * springs.damping_n_s_m;
  for_each_spring(mesh, springs, at.s * at.s * springs.stiffness_n_m, [&](std::size_t e, double spring) {
    const auto [a, b] = mesh.edges[e];
    EdgeTangent& tangent = tangents.edges[e];
    const Vec3d way = at.x[b] - at.x[a];
    const double length = way.norm();
    const double per_length = length > 0.0 ? 1.0 / length : 0.0;
    Eigen::Map<Vec3d>(tangent.direction) = per_length * way;
    tangent.along = length > 0.0 ? spring + damping : 0.0;
    Eigen::Map<Vec3d>(tangent.turn).setZero();
    tangent.across = spring * std::max(0.0, 1.0 - static_cast<double>(body.rest_length_m(e)) * per_length);
  });
}

template <class Real>
void SpringForce::stiffen(const SoftState<Real>&, const Bound& bound, const MatrixPlace& at, MatrixEntries& entries) {
  const std::vector<double>& scale = bound.vertex_stiffness_scale;
  for (const auto& [a, b] : at.mesh.edges) {
    const double stiffness_n_m = (scale.empty() ? 1.0 : 0.5 * (scale[a] + scale[b])) * bound.stiffness_n_m;
    const double spring = at.s * (bound.damping_n_s_m + at.s * (stiffness_n_m + at.pressure_stiffness_n_m));
    entries.add(a, a, spring);
    entries.add(b, b, spring);
    entries.add(a, b, -spring);
    entries.add(b, a, -spring);
  }
}

// Across is the share k (1 - L0 / L) of a spring that is stretched at the start; a slack one pushes its ends aside,
// which makes no motion faster.
void SpringForce::add_to_skin(const Mesh&, const Springs& springs, SkinMotion& skin) {
  skin.stiffness = {springs.stiffness_n_m, springs.stiffness_n_m * std::max(0.0, 1.0 - springs.rest_scale), &springs};
  skin.damping = {.along = springs.damping_n_s_m};
}

template <class Real>
void SpringForce::Xpbd<Real>::begin(const XpbdPlace<Real>& place) {
  const SoftBody& body = place.body.body;
  pulls.assign(body.springs.stiffness_n_m > 0.0 ? body.mesh->edges.size() : 0, Real{0});
}

template <class Real>
void SpringForce::Xpbd<Real>::pass(const XpbdPlace<Real>& place, XpbdWay way) {
  if (pulls.empty()) return;
  const StageTimer timer(place.profile, Stage::springs);
  SoftState<Real>& body = place.body;
  const Springs& springs = body.body.springs;
  const std::span<const Real> inverse_masses = place.inverse_masses_1_kg;
  const auto all_stiffness = static_cast<Real>(place.h_s * place.h_s * springs.stiffness_n_m);
  go_over(pulls.size(), way, [&](std::size_t i) {
    const auto [a, b] = body.body.mesh->edges[i];
    const Vec3<Real> along = body.x[b] - body.x[a] + (body.dr[b] - body.dr[a]);
    const Real length = along.norm();
    if (!(length > 0)) return;
    Real stiffness = all_stiffness;
    if (!springs.vertex_stiffness_scale.empty()) stiffness *= static_cast<Real>(springs.stiffness_scale({a, b}));
    const Real give = inverse_masses[a] + inverse_masses[b];
    Real& pull = pulls[i];
    const Real more = (stiffness * (length - body.rest_length_m(i)) - pull) / (Real{1} + stiffness * give);
    pull += more;
    const Vec3<Real> towards = more / length * along;
    body.dr[a] += inverse_masses[a] * towards;
    body.dr[b] -= inverse_masses[b] * towards;
  });
}

template <class Real>
void SpringForce::Xpbd<Real>::damp(const XpbdPlace<Real>& place) const {
  SoftState<Real>& body = place.body;
  const std::span<const Real> inverse_masses = place.inverse_masses_1_kg;
  const auto damping = static_cast<Real>(place.h_s * body.body.springs.damping_n_s_m);
  if (!(damping > 0)) return;
  for (const auto& [a, b] : body.body.mesh->edges) {
    const Vec3<Real> along = body.x[b] - body.x[a] + (body.dr[b] - body.dr[a]);
    const Real squared = along.squaredNorm();
    if (!(squared > 0)) continue;
    const Real give = inverse_masses[a] + inverse_masses[b];
    const Real apart = along.dot(body.v[b] - body.v[a]) / squared;
    const Vec3<Real> pull = damping * apart / (Real{1} + damping * give) * along;
    body.v[a] += inverse_masses[a] * pull;
    body.v[b] -= inverse_masses[b] * pull;
  }
}

template struct SpringForce::Xpbd<float>;
template struct SpringForce::Xpbd<double>;
#define PNEUMA_INSTANTIATE(Real)                                                                             \
  template double SpringForce::potential_j(const SoftState<Real>&, const EnergyPlace&, const Surroundings&); \
  template void SpringForce::linearise(const SoftState<Real>&, const TangentPlace&, Tangents&);              \
  template void SpringForce::stiffen(const SoftState<Real>&, const Bound&, const MatrixPlace&, MatrixEntries&);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
