#include "numerics/extremes/bullet.h"

#include <cstdlib>
#include <utility>
#include <vector>

#include "numerics/extremes/run.h"

namespace pneuma::extremes {

bench::BulletBall bullet_ball(const physics::SoftBody& body, double dt_s, const bench::BulletSettings& settings) {
  std::vector<physics::Vec3d> at_rest_m = body.mesh->positions_m;
  for (physics::Vec3d& x : at_rest_m) x *= body.springs.rest_scale;
  const auto mesh = physics::make_mesh(std::move(at_rest_m), body.mesh->faces);
  if (!mesh.ok()) std::abort();  // a mesh of a scene that was admitted, in another size
  bench::BallCase ball{.mass_kg = body.mass_kg, .nrt_j = nrt_j(body), .gravity_m_s2 = 0.0, .dt_s = dt_s};
  bench::BulletBall peer(**mesh, ball, settings);
  peer.place(body.start_shape_m(), body.velocity);
  return peer;
}

}  // namespace pneuma::extremes
