// Shows that a good scene passes and that each single fault is refused under its field's path: one change of the good
// scene a row.
#include "physics/scene/admission.h"

#include <algorithm>
#include <limits>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

/// Two soft bodies (a ball of gas and a sheet), two rigid bodies and one collider of each shape.
Scene good_scene() {
  Scene scene;
  scene.name = "good";
  scene.gravity = {0, -9.81, 0};
  SoftBody ball;
  ball.name = "ball";
  ball.mesh = *make_icosphere(1, 1.0);
  ball.springs = {100.0, 0.1, 1.0};
  ball.gas = Gas{.moles = 0.1};
  ball.pins = {0, 41};
  SoftBody sheet;
  sheet.name = "sheet";
  sheet.mesh = *make_grid(3, 3, 1.0, 1.0);
  sheet.pin_boundary = true;
  sheet.surface = {0.5, 0.3, 0.01};
  scene.soft_bodies = {ball, sheet};
  RigidBody stone;
  stone.name = "stone";
  stone.shape = SphereShape{0.2};
  RigidBody crate;
  crate.name = "crate";
  crate.shape = BoxShape{{0.1, 0.2, 0.3}};
  scene.rigid_bodies = {stone, crate};
  const std::vector<Shape> shapes{PlaneShape{},           SphereShape{1.0},
                                  BoxShape{{1, 2, 3}},    EllipsoidShape{{1, 2, 3}},
                                  CapsuleShape{0.5, 0.0}, RoomShape{{5, 5, 5}}};
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    Collider collider;
    collider.name = "collider-" + std::to_string(i);
    collider.shape = shapes[i];
    scene.colliders.push_back(collider);
  }
  return scene;
}

/// Of the ball, whose other vertices have 1.
void scale_vertex(Scene& scene, std::size_t vertex, double scale) {
  scene.soft_bodies[0].vertex_mass_scale.assign(42, 1.0);
  scene.soft_bodies[0].vertex_mass_scale[vertex] = scale;
}

TEST(CheckScene, PassesAGoodSceneAndAnEmptyOne) {
  EXPECT_TRUE(check_scene(good_scene()).ok()) << check_scene(good_scene()).message();
  EXPECT_TRUE(check_scene(Scene{}).ok());
}

TEST(CheckScene, PassesTheLimitsThemselves) {
  Scene scene = good_scene();
  scene.stepping.rate_hz = base::rate_hz_max;
  scene.stepping.substeps = base::substeps_max;
  scene.stepping.error_target = 0.5;
  scene.soft_bodies[1].surface = {1.0, 0.0, 0.0};
  scene.soft_bodies[1].springs = {0.0, 0.0, 0.5};
  scene.soft_bodies[0].gas->moles = 0.0;
  scale_vertex(scene, 3, base::vertex_mass_ratio_max);
  scene.soft_bodies[0].name = std::string(base::name_bytes_max, 'x');
  EXPECT_TRUE(check_scene(scene).ok()) << check_scene(scene).message();
}

TEST(CheckScene, PassesTinyAndHugeScenesThatAreReal) {
  for (const double unit_m : {1e-3, 1e3}) {
    Scene scene = good_scene();
    SoftBody& ball = scene.soft_bodies[0];
    ball.mesh = *make_icosphere(3, unit_m);
    ball.mass_kg = 1e-6;
    ball.springs = {1e9, 1e3, 0.9};
    ball.gas = Gas{.moles = 4e3};  // nRT of 1e7 J
    ball.position = {3 * unit_m, 0, 0};
    scene.rigid_bodies[0].shape = SphereShape{unit_m};
    for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
      scene.stepping.precision = precision;
      EXPECT_TRUE(check_scene(scene).ok()) << check_scene(scene).message();
    }
  }
}

TEST(CheckScene, SinglePrecisionHoldsBodiesOfUpToSoManyEdges) {
  Scene scene = good_scene();
  SoftBody& sheet = scene.soft_bodies[1];
  sheet.position = {9e6, 0, -9e6};  // wherever they are
  sheet.start_positions_m = sheet.mesh->positions_m;
  const double shortest_m = *std::ranges::min_element(sheet.mesh->edge_lengths_m);
  scene.stepping.precision = Precision::single_precision;
  sheet.start_positions_m[5] = {0.99 * base::single_precision_edges_max * shortest_m, 0, 0};
  EXPECT_TRUE(check_scene(scene).ok()) << check_scene(scene).message();
  sheet.start_positions_m[5] = {1.01 * base::single_precision_edges_max * shortest_m, 0, 0};
  EXPECT_EQ(check_scene(scene).where(), "soft_bodies[1].mesh");
  EXPECT_NE(check_scene(scene).what().find("DOUBLE does"), std::string::npos) << check_scene(scene).what();
  scene.stepping.precision = Precision::double_precision;
  EXPECT_TRUE(check_scene(scene).ok()) << check_scene(scene).message();
}

struct Row {
  std::string_view where;
  void (*change)(Scene&);
  base::StatusCode code = base::StatusCode::invalid_argument;
};
std::ostream& operator<<(std::ostream& out, const Row& row) {
  return out << row.where;
}

constexpr base::StatusCode limit = base::StatusCode::limit_exceeded;

class CheckSceneRefuses : public testing::TestWithParam<Row> {};

TEST_P(CheckSceneRefuses, NamingTheField) {
  Scene scene = good_scene();
  GetParam().change(scene);
  const base::Status status = check_scene(scene);
  EXPECT_EQ(status.where(), GetParam().where);
  EXPECT_EQ(status.code(), GetParam().code);
  EXPECT_FALSE(status.what().empty());
}

void add_bodies(Scene& scene, std::size_t count, std::uint32_t subdivisions) {
  const auto mesh = *make_icosphere(subdivisions, 1.0);
  for (std::size_t i = 0; i < count; ++i) {
    SoftBody body;
    body.name = "more-" + std::to_string(i);
    body.mesh = mesh;
    scene.soft_bodies.push_back(body);
  }
}

INSTANTIATE_TEST_SUITE_P(
    SceneAndStepping, CheckSceneRefuses,
    testing::ValuesIn(std::vector{
        Row{"name", [](Scene& s) { s.name = std::string(base::name_bytes_max + 1, 'x'); }, limit},
        Row{"name", [](Scene& s) { s.name = "two\nlines"; }},
        Row{"gravity.y", [](Scene& s) { s.gravity.y() = not_a_number; }},
        Row{"stepping.rate_hz", [](Scene& s) { s.stepping.rate_hz = 0.5; }, limit},
        Row{"stepping.rate_hz", [](Scene& s) { s.stepping.rate_hz = 1001; }, limit},
        Row{"stepping.rate_hz", [](Scene& s) { s.stepping.rate_hz = not_a_number; }},
        Row{"stepping.substeps", [](Scene& s) { s.stepping.substeps = base::substeps_max + 1; }, limit},
        Row{"stepping.error_target", [](Scene& s) { s.stepping.error_target = 0.0; }},
        Row{"stepping.error_target", [](Scene& s) { s.stepping.error_target = 0.6; }},
        Row{"atmosphere.pressure_pa", [](Scene& s) { s.atmosphere.pressure_pa = -1; }},
        Row{"atmosphere.density_kg_m3", [](Scene& s) { s.atmosphere.density_kg_m3 = infinite; }},
        Row{"atmosphere.wind.z", [](Scene& s) { s.atmosphere.wind.z() = 2e5; }, limit},
        Row{"soft_bodies", [](Scene& s) { add_bodies(s, base::world_bodies_max - 1, 0); }, limit},
        Row{"rigid_bodies", [](Scene& s) { add_bodies(s, base::world_bodies_max - 3, 0); }, limit},
        Row{"soft_bodies", [](Scene& s) { add_bodies(s, 7, 6); }, limit},
        Row{"colliders", [](Scene& s) { s.colliders.resize(base::world_colliders_max + 1, s.colliders[0]); }, limit}}));

INSTANTIATE_TEST_SUITE_P(Names, CheckSceneRefuses,
                         testing::ValuesIn(std::vector{
                             Row{"soft_bodies[1].name", [](Scene& s) { s.soft_bodies[1].name = "ball"; }},
                             Row{"soft_bodies[0].name", [](Scene& s) { s.soft_bodies[0].name = ""; }},
                             Row{"soft_bodies[0].name", [](Scene& s) { s.soft_bodies[0].name = std::string(200, 'x'); },
                                 limit},
                             Row{"rigid_bodies[1].name", [](Scene& s) { s.rigid_bodies[1].name = "sheet"; }},
                             Row{"colliders[2].name", [](Scene& s) { s.colliders[2].name = "stone"; }},
                             Row{"colliders[2].name", [](Scene& s) { s.colliders[2].name = "a\tb"; }}}));

INSTANTIATE_TEST_SUITE_P(
    SoftBodies, CheckSceneRefuses,
    testing::ValuesIn(std::vector{
        Row{"soft_bodies[1].mesh", [](Scene& s) { s.soft_bodies[1].mesh = nullptr; }},
        Row{"soft_bodies[0].position.x", [](Scene& s) { s.soft_bodies[0].position.x() = infinite; }},
        Row{"soft_bodies[0].position.x", [](Scene& s) { s.soft_bodies[0].position.x() = -2e7; }, limit},
        Row{"soft_bodies[0].position", [](Scene& s) { s.soft_bodies[0].position.z() = 1e7; }, limit},
        Row{"soft_bodies[0].orientation", [](Scene& s) { s.soft_bodies[0].orientation = Quatd(0, 0, 0, 0); }},
        Row{"soft_bodies[0].orientation.w", [](Scene& s) { s.soft_bodies[0].orientation.w() = not_a_number; }},
        Row{"soft_bodies[0].velocity.y", [](Scene& s) { s.soft_bodies[0].velocity.y() = 1.1e5; }, limit},
        Row{"soft_bodies[0].velocity", [](Scene& s) { s.soft_bodies[0].velocity = {9e4, 9e4, 0}; }, limit},
        Row{"soft_bodies[1].angular_velocity.x",
            [](Scene& s) { s.soft_bodies[1].angular_velocity.x() = not_a_number; }},
        Row{"soft_bodies[0].mass_kg", [](Scene& s) { s.soft_bodies[0].mass_kg = 0; }},
        Row{"soft_bodies[1].mass_kg", [](Scene& s) { s.soft_bodies[1].mass_kg = -1; }},
        Row{"soft_bodies[0].mass_kg", [](Scene& s) { s.soft_bodies[0].mass_kg = infinite; }},
        Row{"soft_bodies[0].springs.stiffness_n_m", [](Scene& s) { s.soft_bodies[0].springs.stiffness_n_m = -1; }},
        Row{"soft_bodies[0].springs.damping_n_s_m", [](Scene& s) { s.soft_bodies[0].springs.damping_n_s_m = -1; }},
        Row{"soft_bodies[0].springs.rest_scale", [](Scene& s) { s.soft_bodies[0].springs.rest_scale = 0; }},
        Row{"soft_bodies[0].gas.moles", [](Scene& s) { s.soft_bodies[0].gas->moles = -1; }},
        Row{"soft_bodies[0].gas.temperature_k", [](Scene& s) { s.soft_bodies[0].gas->temperature_k = 0; }},
        Row{"soft_bodies[0].gas.heat_capacity_ratio", [](Scene& s) { s.soft_bodies[0].gas->heat_capacity_ratio = 1; }},
        Row{"soft_bodies[0].gas.flow_mol_s", [](Scene& s) { s.soft_bodies[0].gas->flow_mol_s = not_a_number; }},
        Row{"soft_bodies[0].gas.leak_mol_s_pa", [](Scene& s) { s.soft_bodies[0].gas->leak_mol_s_pa = -1; }},
        Row{"soft_bodies[1].mesh", [](Scene& s) { s.soft_bodies[1].gas = Gas{}; }},
        Row{"soft_bodies[0].volume.resolution",
            [](Scene& s) { s.soft_bodies[0].volume = {VolumeMethod::subdivided, 129}; }, limit},
        Row{"soft_bodies[0].volume.resolution",
            [](Scene& s) { s.soft_bodies[0].volume = {VolumeMethod::monte_carlo, 65'537}; }, limit},
        Row{"soft_bodies[0].volume.resolution",
            [](Scene& s) { s.soft_bodies[0].volume = {VolumeMethod::monte_carlo, 0}; }},
        Row{"soft_bodies[0].volume.resolution", [](Scene& s) { s.soft_bodies[0].volume = {VolumeMethod::box, 8}; }},
        Row{"soft_bodies[1].surface.restitution", [](Scene& s) { s.soft_bodies[1].surface.restitution = 1.1; }},
        Row{"soft_bodies[1].surface.friction", [](Scene& s) { s.soft_bodies[1].surface.friction = -0.1; }},
        Row{"soft_bodies[1].surface.thickness_m", [](Scene& s) { s.soft_bodies[1].surface.thickness_m = -0.1; }},
        Row{"soft_bodies[0].pins[1]", [](Scene& s) { s.soft_bodies[0].pins[1] = 42; }},
        Row{"soft_bodies[0].pin_boundary", [](Scene& s) { s.soft_bodies[0].pin_boundary = true; }},
        Row{"soft_bodies[0].springs.vertex_stiffness_scale",
            [](Scene& s) { s.soft_bodies[0].springs.vertex_stiffness_scale.assign(41, 1.0); }},
        Row{"soft_bodies[0].springs.vertex_stiffness_scale[7]",
            [](Scene& s) {
              s.soft_bodies[0].springs.vertex_stiffness_scale.assign(42, 1.0);
              s.soft_bodies[0].springs.vertex_stiffness_scale[7] = not_a_number;
              s.soft_bodies[0].springs.vertex_stiffness_scale[9] = -1.0;
            }},
        Row{"soft_bodies[0].springs.vertex_stiffness_scale[41]",
            [](Scene& s) {
              s.soft_bodies[0].springs.vertex_stiffness_scale.assign(42, 0.0);
              s.soft_bodies[0].springs.vertex_stiffness_scale[41] = -1e-9;
            }},
        Row{"soft_bodies[0].springs.vertex_stiffness_scale[0]",
            [](Scene& s) { s.soft_bodies[0].springs.vertex_stiffness_scale.assign(42, 1.01e12); }, limit},
        Row{"soft_bodies[0].start_positions",
            [](Scene& s) { s.soft_bodies[0].start_positions_m.assign(41, Vec3d::Zero()); }},
        Row{"soft_bodies[0].start_positions[124]",
            [](Scene& s) {
              s.soft_bodies[0].start_positions_m.assign(42, Vec3d::Zero());
              s.soft_bodies[0].start_positions_m[41].y() = not_a_number;
            }},
        Row{"soft_bodies[0].start_positions[0]",
            [](Scene& s) { s.soft_bodies[0].start_positions_m.assign(42, Vec3d(2e7, 0, 0)); }, limit},
        Row{"soft_bodies[0].vertex_mass_scale", [](Scene& s) { s.soft_bodies[0].vertex_mass_scale.assign(41, 1.0); }},
        Row{"soft_bodies[0].vertex_mass_scale[7]", [](Scene& s) { scale_vertex(s, 7, 0.0); }},
        Row{"soft_bodies[0].vertex_mass_scale[7]", [](Scene& s) { scale_vertex(s, 7, -1.0); }},
        Row{"soft_bodies[0].vertex_mass_scale[41]", [](Scene& s) { scale_vertex(s, 41, not_a_number); }},
        Row{"soft_bodies[0].vertex_mass_scale[7]", [](Scene& s) { scale_vertex(s, 7, infinite); }},
        Row{"soft_bodies[0].vertex_mass_scale[7]", [](Scene& s) { scale_vertex(s, 7, 1.01e12); }, limit},
        Row{"soft_bodies[0].vertex_mass_scale[7]", [](Scene& s) { scale_vertex(s, 7, 1.01e9); }, limit},
        Row{"soft_bodies[0].vertex_mass_scale[0]", [](Scene& s) { scale_vertex(s, 7, 0.99e-9); }, limit},
        Row{"soft_bodies[0].position",
            [](Scene& s) {
              s.soft_bodies[0].position.x() = 5e6;
              s.soft_bodies[0].start_positions_m.assign(42, Vec3d(6e6, 0, 0));
            },
            limit},
        Row{"soft_bodies[0].drag.normal", [](Scene& s) { s.soft_bodies[0].drag.normal = -1; }},
        Row{"soft_bodies[0].drag.tangential", [](Scene& s) { s.soft_bodies[0].drag.tangential = not_a_number; }}}));

INSTANTIATE_TEST_SUITE_P(
    Solids, CheckSceneRefuses,
    testing::ValuesIn(std::vector{
        Row{"rigid_bodies[0].shape", [](Scene& s) { s.rigid_bodies[0].shape = EllipsoidShape{{1, 1, 1}}; }},
        Row{"rigid_bodies[0].shape",
            [](Scene& s) { s.rigid_bodies[0].shape = MeshShape{"ball", s.soft_bodies[0].mesh}; }},
        Row{"rigid_bodies[0].shape.capsule.radius_m", [](Scene& s) { s.rigid_bodies[0].shape = CapsuleShape{0, 1}; }},
        Row{"colliders[0].shape.mesh", [](Scene& s) { s.colliders[0].shape = MeshShape{}; }},
        Row{"colliders",
            [](Scene& s) {
              for (std::size_t i = 0; i < 2; ++i) s.colliders[i].shape = MeshShape{"ball", *make_icosphere(6, 1.0)};
            },
            limit},
        Row{"rigid_bodies[0].shape.sphere.radius_m", [](Scene& s) { s.rigid_bodies[0].shape = SphereShape{0}; }},
        Row{"rigid_bodies[1].shape.box.half_extents.y",
            [](Scene& s) { s.rigid_bodies[1].shape = BoxShape{{1, -1, 1}}; }},
        Row{"rigid_bodies[0].mass_kg", [](Scene& s) { s.rigid_bodies[0].mass_kg = 0; }},
        Row{"rigid_bodies[0].position.z", [](Scene& s) { s.rigid_bodies[0].position.z() = not_a_number; }},
        Row{"rigid_bodies[1].orientation", [](Scene& s) { s.rigid_bodies[1].orientation = Quatd(2, 0, 0, 0); }},
        Row{"rigid_bodies[0].velocity.x", [](Scene& s) { s.rigid_bodies[0].velocity.x() = -2e5; }, limit},
        Row{"rigid_bodies[0].surface.friction", [](Scene& s) { s.rigid_bodies[0].surface.friction = infinite; }},
        Row{"colliders[0].shape.plane.normal", [](Scene& s) { s.colliders[0].shape = PlaneShape{{0, 0, 0}}; }},
        Row{"colliders[0].shape.plane.normal.x",
            [](Scene& s) { s.colliders[0].shape = PlaneShape{{not_a_number, 0, 0}}; }},
        Row{"colliders[1].shape.sphere.radius_m", [](Scene& s) { s.colliders[1].shape = SphereShape{not_a_number}; }},
        Row{"colliders[1].shape.sphere.radius_m", [](Scene& s) { s.colliders[1].shape = SphereShape{2e7}; }, limit},
        Row{"colliders[2].shape.box.half_extents.x", [](Scene& s) { s.colliders[2].shape = BoxShape{{0, 1, 1}}; }},
        Row{"colliders[3].shape.ellipsoid.radii.z", [](Scene& s) { s.colliders[3].shape = EllipsoidShape{{1, 1, 0}}; }},
        Row{"colliders[4].shape.capsule.radius_m", [](Scene& s) { s.colliders[4].shape = CapsuleShape{0, 1}; }},
        Row{"colliders[4].shape.capsule.half_height_m", [](Scene& s) { s.colliders[4].shape = CapsuleShape{1, -1}; }},
        Row{"colliders[5].shape.room.half_extents.z", [](Scene& s) { s.colliders[5].shape = RoomShape{{1, 1, 0}}; }},
        Row{"colliders[5].angular_velocity.y", [](Scene& s) { s.colliders[5].angular_velocity.y() = infinite; }},
        Row{"colliders[5].surface.restitution", [](Scene& s) { s.colliders[5].surface.restitution = -0.1; }}}));

INSTANTIATE_TEST_SUITE_P(
    FiniteButNoScene, CheckSceneRefuses,
    testing::ValuesIn(std::vector{
        Row{"gravity.y", [](Scene& s) { s.gravity.y() = -1e308; }, limit},
        Row{"atmosphere.density_kg_m3", [](Scene& s) { s.atmosphere.density_kg_m3 = 1e308; }, limit},
        Row{"soft_bodies[0].mesh", [](Scene& s) { s.soft_bodies[0].mesh = *make_icosphere(3, 2e-7); }, limit},
        Row{"soft_bodies[0].mass_kg", [](Scene& s) { s.soft_bodies[0].mass_kg = 1e-310; }, limit},
        Row{"soft_bodies[0].mass_kg", [](Scene& s) { s.soft_bodies[0].mass_kg = 1e308; }, limit},
        Row{"soft_bodies[0].springs.stiffness_n_m", [](Scene& s) { s.soft_bodies[0].springs.stiffness_n_m = 1e308; },
            limit},
        Row{"soft_bodies[0].springs.damping_n_s_m", [](Scene& s) { s.soft_bodies[0].springs.damping_n_s_m = 1e308; },
            limit},
        Row{"soft_bodies[0].springs.rest_scale", [](Scene& s) { s.soft_bodies[0].springs.rest_scale = 1e308; }, limit},
        Row{"soft_bodies[0].gas.moles", [](Scene& s) { s.soft_bodies[0].gas->moles = 1e308; }, limit},
        Row{"soft_bodies[0].gas.temperature_k", [](Scene& s) { s.soft_bodies[0].gas->temperature_k = 1e308; }, limit},
        Row{"soft_bodies[0].gas.heat_capacity_ratio",
            [](Scene& s) { s.soft_bodies[0].gas->heat_capacity_ratio = 1e308; }, limit},
        Row{"soft_bodies[0].gas.flow_mol_s", [](Scene& s) { s.soft_bodies[0].gas->flow_mol_s = -1e308; }, limit},
        Row{"soft_bodies[0].drag.normal", [](Scene& s) { s.soft_bodies[0].drag.normal = 1e308; }, limit},
        Row{"rigid_bodies[0].surface.friction", [](Scene& s) { s.rigid_bodies[0].surface.friction = 1e308; }, limit},
        Row{"rigid_bodies[1].mass_kg", [](Scene& s) { s.rigid_bodies[1].mass_kg = 1e-310; }, limit},
        Row{"rigid_bodies[1].shape.box.half_extents.x",
            [](Scene& s) { s.rigid_bodies[1].shape = BoxShape{{1e-160, 1, 1}}; }, limit}}));

}  // namespace
}  // namespace pneuma::physics
