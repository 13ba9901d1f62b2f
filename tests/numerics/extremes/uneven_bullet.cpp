#include "numerics/extremes/uneven_bullet.h"

#include <algorithm>

#include "numerics/extremes/bullet.h"
#include "numerics/extremes/run.h"

namespace pneuma::extremes {

namespace {

constexpr double dt_s = 1.0 / 60.0;

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

}  // namespace pneuma::extremes
