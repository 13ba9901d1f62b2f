// Shows that a body may pass through shapes that no mesh may have: faces without area, vertices that coincide, all of
// them at one point, mirrored, or scrambled. By every method and in both precisions its motion stays finite, or the
// body is frozen and reported; what lost its volume tells so.
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"
#include "support/stepping_methods.h"

namespace pneuma::physics {
namespace {

struct Start {
  const char* what;
  std::vector<Vec3d> positions_m;
  bool loses_volume;
};

/// Ways to begin that no mesh may have at rest.
std::vector<Start> starts_of(const Mesh& mesh) {
  std::vector<Start> starts(6, {"", mesh.positions_m, false});
  starts[0].what = "a face in one line";
  const auto& [a, b, c] = mesh.faces[0];
  starts[0].positions_m[c] = 0.5 * (mesh.positions_m[a] + mesh.positions_m[b]);
  starts[1].what = "two vertices at one place";
  starts[1].positions_m[b] = mesh.positions_m[a];
  starts[2].what = "a face at one point";
  starts[2].positions_m[b] = starts[2].positions_m[c] = mesh.positions_m[a];
  starts[3] = {"all at one point", std::vector<Vec3d>(mesh.positions_m.size(), Vec3d(0.1, 0.2, 0.3)), true};
  starts[4].what = "flat";
  starts[4].loses_volume = true;
  for (Vec3d& position : starts[4].positions_m) position.y() = 0.0;
  starts[5].what = "scrambled";
  std::shuffle(starts[5].positions_m.begin(), starts[5].positions_m.end(), std::mt19937(3));
  return starts;
}

bool is_finite(const World& world) {
  std::vector<double> positions_m(3 * world.soft_body(0).mesh->positions_m.size());
  world.copy_positions(0, positions_m);
  const BodyMeasures m = world.measure(0);
  return std::ranges::all_of(positions_m, [](double value) { return std::isfinite(value); }) &&
         std::isfinite(m.volume_m3 + m.pressure_pa + m.kinetic_j + m.elastic_j + m.gas_j);
}

class DegenerateMotion : public testing::TestWithParam<SteppingMethod> {};

TEST_P(DegenerateMotion, StaysFiniteOrIsReported) {
  const auto mesh = *make_icosphere(1, 0.5);
  for (const Start& start : starts_of(*mesh)) {
    for (const VolumeMethod volume : {VolumeMethod::exact, VolumeMethod::ellipsoid}) {
      Scene scene;
      scene.gravity = {0, -9.81, 0};
      scene.stepping = {.substeps = 32,
                        .integrator = GetParam().integrator,
                        .precision = GetParam().precision,
                        .on_unstable = OnUnstable::allow};
      SoftBody body;
      body.name = "body";
      body.mesh = mesh;
      body.start_positions_m = start.positions_m;
      body.springs = {.stiffness_n_m = 60.0, .damping_n_s_m = 1.0, .bend_stiffness_n_m = 0.01};
      body.gas = Gas{.moles = 0.01, .law = GasLaw::adiabatic};
      body.volume.method = volume;
      body.drag = {0.5, 0.1};
      scene.atmosphere.density_kg_m3 = 1.2;
      scene.soft_bodies = {body};
      SoftBody other = body;
      other.name = "other";
      other.start_positions_m.clear();
      other.position = {0.2, 1.3, 0.0};
      scene.soft_bodies.push_back(other);
      Collider floor;
      floor.name = "floor";
      floor.position = {0, -0.8, 0};
      scene.colliders = {floor};
      auto made = World::create(scene);
      ASSERT_TRUE(made.ok()) << start.what << ": " << made.status().message();
      World world = std::move(*made);
      Workers workers(1);
      std::size_t inverted = 0;
      std::size_t reported = 0;
      for (int tick = 0; tick < 30; ++tick) {
        world.step_tick(workers);
        inverted += world.take_gas_events().size();
        reported += world.take_frozen().size();
        ASSERT_TRUE(is_finite(world)) << start.what << " at tick " << tick;
      }
      const bool frozen = world.is_frozen(0) || world.is_frozen(1);
      EXPECT_EQ(frozen, reported > 0) << start.what;
      if (start.loses_volume && volume == VolumeMethod::exact) {
        EXPECT_GT(inverted + reported, 0U) << start.what;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, DegenerateMotion, testing::ValuesIn(every_stepping_method()),
                         name_of_stepping_method);

}  // namespace
}  // namespace pneuma::physics
