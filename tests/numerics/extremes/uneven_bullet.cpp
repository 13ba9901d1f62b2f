#include "numerics/extremes/uneven_bullet.h"

#include <algorithm>

#include "numerics/extremes/bullet.h"
#include "numerics/extremes/run.h"

namespace pneuma::extremes {

namespace {

constexpr double dt_s = 1.0 / 60.0;

struct Momenta {
  physics::Vec3d momentum = physics::Vec3d::Zero();
  physics::Vec3d spin = physics::Vec3d::Zero();
};

Momenta momenta_of(const bench::BulletBall& peer, const std::vector<double>& masses_kg) {
  const std::vector<physics::Vec3d> x = peer.positions_m();
  const std::vector<physics::Vec3d> v = peer.velocities_m_s();
  double mass_kg = 0.0;
  physics::Vec3d moment = physics::Vec3d::Zero();
  Momenta sums;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mass_kg += masses_kg[i];
    moment += masses_kg[i] * x[i];
    sums.momentum += masses_kg[i] * v[i];
  }
  for (std::size_t i = 0; i < x.size(); ++i) sums.spin += masses_kg[i] * (x[i] - moment / mass_kg).cross(v[i]);
  return sums;
}

}  // namespace

std::string overstretch_in_bullet(const physics::Scene& scene) {
  const physics::SoftBody& body = scene.soft_bodies[0];
  const physics::Mesh& mesh = *body.mesh;
  double stiffest = 0.0;
  for (const physics::Edge& edge : mesh.edges) stiffest = std::max(stiffest, body.springs.stiffness_scale(edge));
  std::string text = "longest stiff edge over its length: ";
  for (const int iterations : {5, 50}) {
    bench::BulletBall peer =
        bullet_ball(body, dt_s, {.iterations = iterations, .link_stiffness = 1.0}, scene.gravity.y());
    double most = 0.0;
    for (int i = 0; i < 600; ++i) {
      peer.step();
      const std::vector<physics::Vec3d> x = peer.positions_m();
      for (std::size_t edge = 0; edge < mesh.edges.size(); ++edge) {
        if (body.springs.stiffness_scale(mesh.edges[edge]) < stiffest) continue;
        const auto [a, b] = mesh.edges[edge];
        const double rest_m = body.springs.rest_scale * mesh.edge_lengths_m[edge];
        most = std::max(most, (x[b] - x[a]).norm() / rest_m - 1.0);
      }
    }
    text.append(iterations == 5 ? "" : ", ").append(percent(most)).append(" at ").append(std::to_string(iterations));
  }
  return text + " iterations";
}

std::string momentum_lost_in_bullet(const physics::Scene& scene) {
  const physics::SoftBody& body = scene.soft_bodies[0];
  const std::vector<double> masses_kg = vertex_masses_kg(body);
  bench::BulletBall peer = bullet_ball(body, dt_s, {.link_stiffness = 1.0, .damping = 0.0});
  const Momenta before = momenta_of(peer, masses_kg);
  for (int i = 0; i < 600; ++i) peer.step();
  const Momenta after = momenta_of(peer, masses_kg);
  return "momentum lost " + brief((after.momentum - before.momentum).norm() / before.momentum.norm()) + ", spin lost " +
         percent((after.spin - before.spin).norm() / before.spin.norm());
}

}  // namespace pneuma::extremes
