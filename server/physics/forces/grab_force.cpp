#include "physics/forces/grab_force.h"

#include <algorithm>

namespace pneuma::physics {
namespace {

// What is left of the grabs of one vertex: an explicit step of a spring much stiffer than m/dt^2 would throw the
// particle about, so they hold no harder than that together, each in its proportion.
struct GrabShares {
  double stiffness = 1.0;
  double damping = 1.0;
};

GrabShares shares_of(std::span<const Grab> grabs, double mass_kg, double dt_s) {
  double stiffness_n_m = 0.0;
  double damping_n_s_m = 0.0;
  for (const Grab& grab : grabs) {
    stiffness_n_m += grab.stiffness_n_m;
    damping_n_s_m += grab.damping_n_s_m;
  }
  const double stiffness_max = 0.25 * mass_kg / (dt_s * dt_s);
  const double damping_max = 0.5 * mass_kg / dt_s;
  return {stiffness_n_m > stiffness_max ? stiffness_max / stiffness_n_m : 1.0,
          damping_n_s_m > damping_max ? damping_max / damping_n_s_m : 1.0};
}

}  // namespace

template <class Real>
void GrabForce::add(SoftState<Real>& body, const ForcePlace<Real>& at, std::span<Vec3<Real>> force) {
  const StageTimer timer(at.profile, Stage::grabs);
  for (auto first = body.grabs.begin(); first != body.grabs.end();) {
    const std::uint32_t vertex = first->vertex;
    const auto last = std::find_if(first, body.grabs.end(), [&](const Grab& grab) { return grab.vertex != vertex; });
    const GrabShares shares = shares_of({first, last}, body.mass_kg(vertex), at.explicit_dt_s);
    for (; first != last; ++first) {
      const Vec3d offset = first->target - body.origin_m - at.x[vertex].template cast<double>();
      const Vec3d pull = shares.stiffness * first->stiffness_n_m * offset -
                         shares.damping * first->damping_n_s_m * at.v[vertex].template cast<double>();
      force[vertex] += pull.cast<Real>();
    }
  }
}

template <class Real>
void GrabForce::Xpbd<Real>::pass(const XpbdPlace<Real>& place, XpbdWay way) {
  if (pulls.empty()) return;
  const StageTimer timer(place.profile, Stage::grabs);
  SoftState<Real>& body = place.body;
  go_over(pulls.size(), way, [&](std::size_t i) {
    const Grab& grab = body.grabs[i];
    if (body.is_pinned(grab.vertex)) return;
    const double stiffness = place.h_s * place.h_s * grab.stiffness_n_m;
    const double damping = place.h_s * grab.damping_n_s_m;
    const auto weight = static_cast<double>(place.inverse_masses_1_kg[grab.vertex]);
    const Vec3d moved = body.dr[grab.vertex].template cast<double>();
    const Vec3d offset = grab.target - body.position_m(grab.vertex) - moved;
    Vec3d& pull = pulls[i];
    const Vec3d more = (stiffness * offset - damping * moved - pull) / (1.0 + (stiffness + damping) * weight);
    pull += more;
    body.dr[grab.vertex] += (weight * more).template cast<Real>();
  });
}

template struct GrabForce::Xpbd<float>;
template struct GrabForce::Xpbd<double>;
template void GrabForce::add(SoftState<float>&, const ForcePlace<float>&, std::span<Vec3<float>>);
template void GrabForce::add(SoftState<double>&, const ForcePlace<double>&, std::span<Vec3<double>>);

}  // namespace pneuma::physics
