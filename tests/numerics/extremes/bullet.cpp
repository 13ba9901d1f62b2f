#include "numerics/extremes/bullet.h"

#include <algorithm>
#include <cstdlib>
#include <utility>
#include <vector>

#include "numerics/extremes/run.h"
#include "physics/forces/soft_setup.h"

namespace pneuma::extremes {

bench::BulletBall bullet_ball(const physics::SoftBody& body, double dt_s, const bench::BulletSettings& settings,
                              double gravity_m_s2) {
  std::vector<physics::Vec3d> at_rest_m = body.mesh->positions_m;
  for (physics::Vec3d& x : at_rest_m) x *= body.springs.rest_scale;
  const auto mesh = physics::make_mesh(std::move(at_rest_m), body.mesh->faces);
  if (!mesh.ok()) std::abort();  // a mesh of a scene that was admitted, in another size
  bench::BallCase ball{
      .mass_kg = body.mass_kg, .nrt_j = body.gas ? nrt_j(body) : 0.0, .gravity_m_s2 = gravity_m_s2, .dt_s = dt_s};
  bench::BulletBall peer(**mesh, ball, settings);
  const auto start = physics::make_soft_state<double>(body);
  peer.set_masses(vertex_masses_kg(body));
  if (std::vector<double> links = body.springs.vertex_stiffness_scale; !links.empty()) {
    const double stiffest = *std::ranges::max_element(links);
    for (double& link : links) link *= settings.link_stiffness / stiffest;
    peer.set_link_stiffness(links);
  }
  peer.place(start.x, start.v);
  return peer;
}

std::vector<double> vertex_masses_kg(const physics::SoftBody& body) {
  const auto start = physics::make_soft_state<double>(body);
  std::vector<double> masses_kg;
  for (std::size_t i = 0; i < start.x.size(); ++i) masses_kg.push_back(start.is_pinned(i) ? 0.0 : start.mass_kg(i));
  return masses_kg;
}

double link_stiffness_of(double stiffness_n_m, double vertex_mass_kg, double dt_s) {
  const double give = 2.0 / vertex_mass_kg;
  return give / (give + 1.0 / (stiffness_n_m * dt_s * dt_s));
}

}  // namespace pneuma::extremes
