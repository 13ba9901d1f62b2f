// Cases of contact: a hit too fast for any step, a load a thousand times as heavy, bodies that begin within each other.
#include <algorithm>
#include <cstdio>
#include <cmath>

#include "numerics/extremes/cases.h"
#include "numerics/extremes/variants.h"

namespace pneuma::extremes {

namespace {

using physics::Quatd;
using physics::Scene;
using physics::Vec3d;
using physics::World;

void run_wall(Scene scene, const Quatd& turn) {
  const physics::BoxShape wall = std::get<physics::BoxShape>(scene.colliders[0].shape);
  scene.colliders[0].orientation = turn;
  World world = make_world(scene);
  physics::Workers workers(1);
  int frozen = 0; double past=0; double past_plate = 0; double rigid_past = 0; int through=0;
  for (int tick = 0; tick < 30; ++tick) {
    world.step_tick(workers);
    frozen += (int)world.take_frozen().size();
    for (std::size_t b = 0; b < 2; ++b) {
      const physics::RigidState& plate = world.rigid_bodies()[2];
      for (const Vec3d& x : positions_of(world, b)) {
        if (!x.allFinite()) past = 1e9;
        if (b == 0) { double l = (turn.conjugate() * x).x() + wall.half_extents_m.x(); past = std::max(past, l); through += l > 1e-3; }
        else { Vec3d l = plate.orientation.conjugate() * (x - plate.position);
        if (std::abs(l.y()) < 5 && std::abs(l.z()) < 5) past_plate = std::max(past_plate, l.x() + 0.005); }
      }
    }
    if (getenv("TRACE") && tick < 4) for (int r = 0; r < 2; ++r) { auto& b = world.rigid_bodies()[r]; Vec3d q = turn.conjugate() * b.position; printf("\n t%d r%d local %g %g %g v %g %g %g w %g %g %g", tick, r, q.x(), q.y(), q.z(), b.velocity.x(), b.velocity.y(), b.velocity.z(), b.angular_velocity.x(), b.angular_velocity.y(), b.angular_velocity.z()); }
    for (int r = 0; r < 2; ++r) rigid_past = std::max(rigid_past, (turn.conjugate() * world.rigid_bodies()[r].position).x() + 0.005);
  }
  printf(" frozen %d past %g (%d) plate %g rigid %g stone v %g\n", frozen, past, through, past_plate, rigid_past, world.rigid_bodies()[0].velocity.norm());
}

void run_load(Scene scene) {
  World world = make_world(scene);
  physics::Workers workers(1);
  for (int s = 0; s < 60; ++s) {
    for (int tick = 0; tick < 60; ++tick) world.step_tick(workers);
    auto& r = world.rigid_bodies()[0];
    if (s % 10 == 9 || s < 3) printf("   %d s: load at %g %g %g up %g speed %g, V %g com %g vmax %g frozen %d\n", s + 1, r.position.x(), r.position.y(), r.position.z(), (r.orientation * Vec3d::UnitY()).y(), r.velocity.norm(), world.measure(0).volume_m3, world.measure(0).centre_of_mass.y(), world.measure(0).max_speed_m_s, world.is_frozen(0));
  }
}
void run_overlap(Scene scene) {
  World world = make_world(scene);
  physics::Workers workers(1);
  std::vector<double> maxv(5), maxc(5); int frozen = 0;
  std::vector<Vec3d> c(4);
  for (std::size_t b = 0; b < 4; ++b) c[b] = world.measure(b).centre_of_mass;
  for (int tick = 0; tick < 120; ++tick) {
    world.step_tick(workers);
    frozen += (int)world.take_frozen().size();
    for (std::size_t b = 0; b < 4; ++b) { auto m = world.measure(b); maxv[b] = std::max(maxv[b], m.max_speed_m_s);
     maxc[b] = std::max(maxc[b], m.momentum.norm()); }
    maxv[4] = std::max(maxv[4], world.rigid_bodies()[0].velocity.norm());
  }
  printf(" frozen %d maxv", frozen);
  for (double v : maxv) printf(" %g", v);
  printf(" mean"); for (double v : maxc) printf(" %g", v);
  printf(" moved"); for (std::size_t b = 0; b < 4; ++b) printf(" %g", (world.measure(b).centre_of_mass - c[b]).norm());
  printf(" E"); for (std::size_t b = 0; b < 4; ++b) printf(" %g", world.measure(b).kinetic_j);
  printf("\n");
}
}  // namespace
std::vector<ExtremeCase> contact_cases() {
  auto only = getenv("ONLY") ? std::string(getenv("ONLY")) : std::string("13 14 15");
  for (auto v : every_variant()) {
    if (only.find("13") != std::string::npos)
    for (double angle : {0.0, 0.6}) {
      Scene scene = load("13-thin-wall.json");
      set(scene, v);
      printf("%s %g:", name_of(v).c_str(), angle);
      run_wall(scene, Quatd(Eigen::AngleAxisd(angle, Vec3d(0.1, 0.2, 1).normalized())));
    }
    if (only.find("14") != std::string::npos) {
      Scene scene = load("14-heavy-on-light.json");
      set(scene, v);
      if (v.integrator == physics::Integrator::explicit_euler) continue;
      printf("%s load:\n", name_of(v).c_str());
      run_load(scene);
    }
    if (only.find("15") != std::string::npos) {
      Scene scene = load("15-deep-overlap.json");
      set(scene, v);
      printf("%s overlap:", name_of(v).c_str());
      run_overlap(scene);
    }
  }
  return {};
}
}
#ifdef SCRATCH
int main() { (void)pneuma::extremes::contact_cases(); }
#endif
