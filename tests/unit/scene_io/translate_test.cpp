// Shows that a scene becomes the engine's with the defaults that scene.proto states, that what is wrong with it or not
// built yet is refused by path, and that the built-in scenes are all admissible and as the paper's figures have them.
#include "scene_io/translate.h"

#include <limits>
#include <sstream>

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include "base/limits.h"
#include "physics/world.h"
#include "scene_io/json.h"
#include "scene_io/load.h"

namespace pneuma::scene_io {
namespace {

constexpr const char* ball_mesh = R"("meshes": [{"name": "ball", "icosphere": {"subdivisions": 2}}])";

base::Result<physics::Scene> translate(const std::string& text) {
  const auto scene = parse_scene_json(text);
  if (!scene.ok()) return scene.status();
  return to_physics(*scene);
}

/// Of a scene with the mesh "ball" and one soft body with these fields.
base::Result<physics::Scene> with_body(const std::string& fields) {
  return translate(std::string("{") + ball_mesh + R"(, "soft_bodies": [{"name": "b", "mesh": "ball")" +
                   (fields.empty() ? "" : ", ") + fields + "}]}");
}

std::string error_of(const base::Result<physics::Scene>& scene) {
  return scene.ok() ? "no error" : scene.status().message();
}

TEST(ToPhysics, EmptySceneHasTheDefaults) {
  const auto scene = translate("{}");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  EXPECT_EQ(scene->gravity, physics::Vec3d::Zero());
  physics::Stepping defaults;
  defaults.integrator = physics::Integrator::automatic;
  EXPECT_EQ(scene->stepping, defaults);
  EXPECT_EQ(scene->stepping.rate_hz, 60.0);
  EXPECT_EQ(scene->stepping.precision, physics::Precision::double_precision);
  EXPECT_EQ(scene->atmosphere.pressure_pa, 0.0);
}

TEST(ToPhysics, SoftBodyHasTheDefaults) {
  const auto scene = with_body(R"("gas": {"moles": 1})");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const physics::SoftBody& body = scene->soft_bodies[0];
  EXPECT_EQ(body.mesh->positions_m.size(), 162U);
  EXPECT_EQ(body.mass_kg, 1.0);
  EXPECT_EQ(body.springs.rest_scale, 1.0);
  EXPECT_EQ(body.gas->temperature_k, 293.15);
  EXPECT_EQ(body.gas->heat_capacity_ratio, 1.4);
  EXPECT_EQ(body.gas->law, physics::GasLaw::isothermal);
  EXPECT_EQ(body.volume, physics::Volume{});
  EXPECT_EQ(body.pressure_spread, physics::PressureSpread::faces);
  EXPECT_EQ(body.collision.soft, physics::SoftCollision::exact);
  EXPECT_FALSE(body.collision.self);
  EXPECT_EQ(body.collision.bounds, physics::BoundsKind::ellipsoid);
  EXPECT_FALSE(body.surface.restitution.has_value());
  EXPECT_EQ(body.orientation.coeffs(), physics::Quatd::Identity().coeffs());
}

TEST(ToPhysics, StartPositionsAreThreeNumbersAVertex) {
  const auto scene = translate(R"({"meshes": [{"name": "m", "grid": {"columns": 1, "rows": 1}}],
      "soft_bodies": [{"name": "b", "mesh": "m", "start_positions": [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]}]})");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  ASSERT_EQ(scene->soft_bodies[0].start_positions_m.size(), 4U);
  EXPECT_EQ(scene->soft_bodies[0].start_positions_m[3], physics::Vec3d(10, 11, 12));
  EXPECT_EQ(error_of(with_body(R"("start_positions": [1, 2, 3])")),
            "soft_bodies[0].start_positions: are 3 numbers; a mesh of 162 vertices has 486");
}

TEST(ToPhysics, VertexMassesAreOneFactorAVertex) {
  const auto scene = translate(R"({"meshes": [{"name": "m", "grid": {"columns": 1, "rows": 1}}],
      "soft_bodies": [{"name": "b", "mesh": "m", "vertex_mass_scale": [1, 2, 3, 4]}]})");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  EXPECT_EQ(scene->soft_bodies[0].vertex_mass_scale, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_EQ(error_of(with_body(R"("vertex_mass_scale": [1, 2])")),
            "soft_bodies[0].vertex_mass_scale: are 2 factors; a mesh of 162 vertices has one for each");
}

TEST(ToPhysics, BodiesShareAMeshBuiltOnce) {
  const auto scene = translate(std::string("{") + ball_mesh +
                               R"(, "soft_bodies": [{"name": "a", "mesh": "ball"}, {"name": "b", "mesh": "ball"}]})");
  ASSERT_TRUE(scene.ok());
  EXPECT_EQ(scene->soft_bodies[0].mesh, scene->soft_bodies[1].mesh);
}

TEST(ToPhysics, RotationsAreNormalisedWhateverTheirSize) {
  for (const char* scale : {"1e-300", "1", "1e300"}) {
    const auto scene = with_body(std::string(R"("orientation": {"w": )") + scale + R"(, "y": )" + scale + "}");
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_NEAR(scene->soft_bodies[0].orientation.w(), std::sqrt(0.5), 1e-15);
    EXPECT_NEAR(scene->soft_bodies[0].orientation.y(), std::sqrt(0.5), 1e-15);
  }
}

TEST(ToPhysics, NumbersFromTheWireThatAreNotFiniteAreNamed) {
  v1::Scene scene;
  auto& collider = *scene.add_colliders();
  collider.set_name("c");
  collider.mutable_shape()->mutable_sphere()->set_radius_m(1);
  collider.mutable_orientation()->set_w(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(to_physics(scene).status().message(), "colliders[0].orientation: is not finite");
  collider.clear_orientation();
  collider.mutable_shape()->mutable_plane()->mutable_normal()->set_x(std::numeric_limits<double>::infinity());
  EXPECT_EQ(to_physics(scene).status().message(), "colliders[0].shape.plane.normal: is not finite");
  collider.mutable_shape()->mutable_sphere()->set_radius_m(-1);
  EXPECT_EQ(to_physics(scene).status().where(), "colliders[0].shape.sphere.radius_m");
}

TEST(ToPhysics, MissingMeshIsNamedWithThoseThereAre) {
  EXPECT_EQ(error_of(translate(std::string("{") + ball_mesh + R"(, "soft_bodies": [{"name": "b", "mesh": "bal"}]})")),
            "soft_bodies[0].mesh: no mesh is named \"bal\"; meshes: ball");
  EXPECT_EQ(error_of(translate(R"({"soft_bodies": [{"name": "b", "mesh": "bal"}]})")),
            "soft_bodies[0].mesh: no mesh is named \"bal\"; there are no meshes");
}

TEST(ToPhysics, MeshErrorsCarryThePath) {
  const std::string corners = R"("positions": [{}, {"x": 1}, {"y": 1}])";
  EXPECT_EQ(
      error_of(translate(R"({"meshes": [{"name": "m", "triangles": {)" + corners + R"(, "indices": [0, 1, 9]}}]})"))
          .substr(0, 41),
      "meshes[0].triangles.indices[0..2]: face 0");
  EXPECT_EQ(error_of(translate(R"({"meshes": [{"name": "m", "triangles": {)" + corners + R"(, "indices": [0, 1]}}]})"))
                .substr(0, 28),
            "meshes[0].triangles.indices:");
  EXPECT_EQ(error_of(translate(R"({"meshes": [{"name": "m", "icosphere": {"subdivisions": 30}}]})")).substr(0, 33),
            "meshes[0].icosphere.subdivisions:");
  EXPECT_EQ(error_of(translate(R"({"meshes": [{"name": "m", "asset": "foot"}]})")),
            "meshes[0].asset: no asset is named \"foot\"; there is: hand");
  EXPECT_EQ(error_of(translate(R"({"meshes": [{"name": "m"}]})")).substr(0, 20), "meshes[0]: has no sh");
  EXPECT_EQ(error_of(translate(
                R"({"meshes": [{"name": "m", "grid": {"columns": 1, "rows": 1}}, {"name": "m", "asset": "hand"}]})")),
            "meshes[1].name: another mesh is named \"m\" too");
}

TEST(ToPhysics, OpenMeshHoldsNoGas) {
  EXPECT_EQ(error_of(translate(R"({"meshes": [{"name": "m", "grid": {"columns": 1, "rows": 1}}],
                                   "soft_bodies": [{"name": "b", "mesh": "m", "gas": {"moles": 1}}]})"))
                .substr(0, 20),
            "soft_bodies[0].mesh:");
}

/// A tetrahedron with one face flipped and another one missing, and a body of it with gas.
std::string broken_tetrahedron(const std::string& more) {
  return R"({"meshes": [{"name": "m", "triangles": {"positions": [{}, {"x": 1}, {"y": 1}, {"z": 1}],
             "indices": [0, 2, 1, 0, 3, 1, 0, 3, 2]})" +
         more + R"(}], "soft_bodies": [{"name": "b", "mesh": "m", "gas": {"moles": 1}}]})";
}

TEST(ToPhysics, ABrokenMeshIsRefusedOrMendedOnRequest) {
  EXPECT_EQ(error_of(translate(broken_tetrahedron(""))).substr(0, 44), "meshes[0].triangles.indices[3..5]: face 1 is");
  EXPECT_EQ(error_of(translate(broken_tetrahedron(R"(, "mend": {"close": false})"))).substr(0, 20),
            "soft_bodies[0].mesh:");
  EXPECT_EQ(error_of(translate(broken_tetrahedron(R"(, "mend": {"orient": false})"))).substr(0, 27),
            "meshes[0].triangles.indices");
  const auto scene = translate(broken_tetrahedron(R"(, "mend": {})"));
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  EXPECT_EQ(scene->soft_bodies[0].mesh->faces.size(), 4U);
}

TEST(ToPhysics, MendIsReadByItsOwnPath) {
  EXPECT_EQ(error_of(translate(broken_tetrahedron(R"(, "mend": {"weld_m": -1})"))),
            "meshes[0].mend.weld_m: must be a length from 0 to 10000000");
  EXPECT_EQ(error_of(translate(R"({"meshes": [{"name": "m", "box": {}, "mend": {}}]})")),
            "meshes[0].mend: is for triangles and assets");
}

TEST(MeshLibrary, TellsWhatItMendedAndNotWhatItTookOver) {
  const auto scene = parse_scene_json(broken_tetrahedron(R"(, "mend": {})"));
  ASSERT_TRUE(scene.ok());
  const auto library = MeshLibrary::build(*scene);
  ASSERT_TRUE(library.ok()) << library.status().message();
  ASSERT_EQ(library->mended().size(), 1U);
  EXPECT_EQ(library->mended()[0].mesh, "m");
  EXPECT_EQ(library->mended()[0].report, (physics::MendReport{.faces_turned = 1, .holes_closed = 1, .faces_added = 1}));
  EXPECT_TRUE(MeshLibrary::build(*scene, *library)->mended().empty());
}

TEST(ToPhysics, AllMeshesTogetherAreBounded) {
  v1::Scene scene;
  for (int i = 0; i < 8; ++i) {
    v1::Mesh& mesh = *scene.add_meshes();
    mesh.set_name(std::string("m").append(std::to_string(i)));  // GCC 12 warns falsely of "m" + ...
    mesh.mutable_grid()->set_columns(250);
    mesh.mutable_grid()->set_rows(250);
  }
  const auto built = to_physics(scene);
  ASSERT_FALSE(built.ok());
  EXPECT_EQ(built.status().code(), base::StatusCode::limit_exceeded);
  EXPECT_EQ(built.status().where(), "meshes[4]");  // 5 * 251^2 > 262,144
}

// They stay in the scene, whatever they are mended to.
TEST(ToPhysics, MeshesToBeMendedCountAsTheyAreWrittenOut) {
  auto scene = parse_scene_json(broken_tetrahedron(R"(, "mend": {})"));
  ASSERT_TRUE(scene.ok());
  v1::Mesh& mesh = *scene->mutable_meshes(0);
  const auto error_of_copies = [&](int copies) {
    v1::Scene all;
    for (int i = 0; i < copies; ++i) {
      *all.add_meshes() = mesh;
      all.mutable_meshes(i)->set_name(std::string("mesh ").append(std::to_string(i)));
    }
    const auto library = MeshLibrary::build(all);
    return library.ok() ? std::string() : library.status().message();
  };
  while (static_cast<std::size_t>(mesh.triangles().positions_size()) < base::mesh_vertices_max) {
    mesh.mutable_triangles()->add_positions();  // of no face
  }
  EXPECT_EQ(error_of_copies(4), "");
  EXPECT_EQ(error_of_copies(5), "meshes[4]: the meshes up to this one have more than 262144 vertices");

  mesh.mutable_triangles()->mutable_positions()->DeleteSubrange(4, static_cast<int>(base::mesh_vertices_max) - 4);
  const v1::Mesh::Triangles once = mesh.triangles();
  while (static_cast<std::size_t>(mesh.triangles().indices_size()) < 3 * base::mesh_faces_max) {
    mesh.mutable_triangles()->add_indices(once.indices(mesh.triangles().indices_size() % once.indices_size()));
  }
  EXPECT_EQ(error_of_copies(5), "meshes[4]: the meshes up to this one have more than 1048576 faces");
}

TEST(ToPhysics, TooManyBodiesAreRefusedByNumber) {
  v1::Scene scene;
  for (std::size_t i = 0; i <= base::world_bodies_max; ++i) scene.add_soft_bodies();
  const auto built = to_physics(scene);
  EXPECT_EQ(built.status().code(), base::StatusCode::limit_exceeded);
  EXPECT_EQ(built.status().where(), "soft_bodies");
}

TEST(ToPhysics, EveryIntegratorIsKnownByItsName) {
  using enum physics::Integrator;
  const std::vector<std::pair<std::string, physics::Integrator>> names{{"EXPLICIT_EULER", explicit_euler},
                                                                       {"MIDPOINT", midpoint},
                                                                       {"RK4", rk4},
                                                                       {"SYMPLECTIC_EULER", symplectic_euler},
                                                                       {"IMPLICIT_EULER", implicit_euler},
                                                                       {"TR_BDF2", tr_bdf2},
                                                                       {"XPBD", xpbd},
                                                                       {"AUTO", automatic}};
  for (const auto& [name, integrator] : names) {
    const auto scene =
        translate(R"({"stepping": {"newton_iterations": 3, "on_unstable": "SUBSTEP", "integrator": ")" + name + "\"}}");
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_EQ(scene->stepping.integrator, integrator);
    EXPECT_EQ(scene->stepping.newton_iterations, 3U);
    EXPECT_EQ(scene->stepping.on_unstable, physics::OnUnstable::substep);
  }
}

TEST(ToPhysics, BodiesSleepUnlessTheSceneSaysOtherwise) {
  EXPECT_TRUE(translate("{}")->stepping.sleep);
  EXPECT_TRUE(translate(R"({"stepping": {"sleep": true}})")->stepping.sleep);
  EXPECT_FALSE(translate(R"({"stepping": {"sleep": false}})")->stepping.sleep);
}

TEST(ToPhysics, VolumeMethodsThatSampleHaveAResolution) {
  using enum physics::VolumeMethod;
  const auto volume = [](const std::string& text) {
    const auto scene = with_body(R"("volume": {)" + text + "}");
    EXPECT_TRUE(scene.ok()) << scene.status().message();
    return scene->soft_bodies[0].volume;
  };
  EXPECT_EQ(volume(R"("method": "ELLIPSOID")"), (physics::Volume{ellipsoid, 0}));
  EXPECT_EQ(volume(R"("method": "ELLIPSOID", "resolution": 0)"), (physics::Volume{ellipsoid, 0}));
  EXPECT_EQ(volume(R"("method": "SUBDIVIDED")"), (physics::Volume{subdivided, 16}));
  EXPECT_EQ(volume(R"("method": "SUBDIVIDED", "resolution": 128)"), (physics::Volume{subdivided, 128}));
  EXPECT_EQ(volume(R"("method": "MONTE_CARLO")"), (physics::Volume{monte_carlo, 4'096}));
  EXPECT_EQ(volume(R"("method": "MONTE_CARLO", "resolution": 65536)"), (physics::Volume{monte_carlo, 65'536}));
}

TEST(ToPhysics, CollisionIsAsTheSceneSays) {
  const auto scene = with_body(R"("collision": {"soft": "BOUNDS", "self": true})");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  EXPECT_EQ(scene->soft_bodies[0].collision.soft, physics::SoftCollision::bounds);
  EXPECT_TRUE(scene->soft_bodies[0].collision.self);
}

TEST(ToPhysics, EnumNumberThatNobodyNamedIsRefused) {
  v1::Scene scene;
  scene.mutable_stepping()->set_integrator(static_cast<v1::Stepping::Integrator>(99));
  EXPECT_EQ(to_physics(scene).status().message().substr(0, 45), "stepping.integrator: this version has no 99; ");
}

TEST(ToPhysics, WhatTheEngineRefusesKeepsItsPath) {
  EXPECT_EQ(error_of(with_body(R"("mass_kg": -1)")).substr(0, 23), "soft_bodies[0].mass_kg:");
  EXPECT_EQ(error_of(with_body(R"("pins": [162])")).substr(0, 23), "soft_bodies[0].pins[0]:");
  EXPECT_EQ(error_of(with_body(R"("volume": {"resolution": 4})")),
            "soft_bodies[0].volume.resolution: is 4; only the methods SUBDIVIDED and MONTE_CARLO have one");
}

TEST(ToProto, ShapesRoundTrip) {
  const auto scene = parse_scene_json(R"({"meshes": [{"name": "m", "icosphere": {}}], "colliders": [
    {"name": "g", "shape": {"mesh": "m"}}, {"name": "a", "shape": {"plane": {"normal": {"x": 1}}}}, {"name": "b", "shape": {"sphere": {"radius_m": 2}}},
    {"name": "c", "shape": {"box": {"half_extents": {"x": 1, "y": 2, "z": 3}}}},
    {"name": "d", "shape": {"ellipsoid": {"radii": {"x": 1, "y": 2, "z": 3}}}},
    {"name": "e", "shape": {"capsule": {"radius_m": 1, "half_height_m": 2}}},
    {"name": "f", "shape": {"room": {"half_extents": {"x": 1, "y": 2, "z": 3}}}}]})");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const auto built = to_physics(*scene);
  ASSERT_TRUE(built.ok()) << built.status().message();
  for (int i = 0; i < scene->colliders_size(); ++i) {
    EXPECT_EQ(to_proto(built->colliders[static_cast<std::size_t>(i)].shape).SerializeAsString(),
              scene->colliders(i).shape().SerializeAsString());
  }
}

TEST(ToPhysics, LockedAxesAndMeshesOfSolids) {
  const auto scene = parse_scene_json(R"({"meshes": [{"name": "m", "icosphere": {}}],
    "rigid_bodies": [{"name": "r", "shape": {"capsule": {"radius_m": 1}},
                      "locked": {"translation": {"x": true, "z": true}, "rotation": {"y": true}}}],
    "colliders": [{"name": "c", "shape": {"mesh": "m"}}, {"name": "d", "shape": {"mesh": "m"}}]})");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const auto built = to_physics(*scene);
  ASSERT_TRUE(built.ok()) << built.status().message();
  EXPECT_EQ(built->rigid_bodies[0].locked, (physics::LockedAxes{{true, false, true}, {false, true, false}}));
  EXPECT_EQ(std::get<physics::MeshShape>(built->colliders[0].shape).mesh,
            std::get<physics::MeshShape>(built->colliders[1].shape).mesh);
  const auto nameless = parse_scene_json(R"({"colliders": [{"name": "c", "shape": {"mesh": "m"}}]})");
  EXPECT_EQ(to_physics(*nameless).status().message(),
            "colliders[0].shape.mesh: no mesh is named \"m\"; there are no meshes");
}

TEST(ToProto, LiveGasIsFoldedIntoTheBodyOfItsName) {
  auto current = builtin_scene("five-balls");
  ASSERT_TRUE(current.ok());
  auto live = to_physics(*current);
  ASSERT_TRUE(live.ok());
  live->soft_bodies[3].gas->moles = 0.5;
  live->soft_bodies[3].gas->temperature_k = 300.0;
  const v1::Scene scene = to_proto(*live, *current);
  EXPECT_EQ(scene.soft_bodies(3).gas().moles(), 0.5);
  EXPECT_EQ(scene.soft_bodies(3).gas().temperature_k(), 300.0);
  EXPECT_EQ(scene.soft_bodies(2).gas().moles(), current->soft_bodies(2).gas().moles());
}

TEST(ToProto, GasThatBurstIsNoMore) {
  const auto current = builtin_scene("five-balls");
  ASSERT_TRUE(current.ok());
  auto live = to_physics(*current);
  ASSERT_TRUE(live.ok());
  live->soft_bodies[3].gas.reset();
  const v1::Scene scene = to_proto(*live, *current);
  EXPECT_FALSE(scene.soft_bodies(3).has_gas());
  EXPECT_TRUE(scene.soft_bodies(2).has_gas());
}

TEST(BuiltinScenes, AreAllAdmissibleAndNamedAsTheirFiles) {
  EXPECT_EQ(builtin_scene_names(),
            (std::vector<std::string>{"ball-pit", "balloon-under-load", "bouncing-ball", "cost-curve", "crumple",
                                      "five-balls", "five-balls-paper", "hand", "hanging-ball", "hero",
                                      "rope-and-balloons", "wind-cloth"}));
  for (const std::string& name : builtin_scene_names()) {
    const auto scene = load_scene(name);
    ASSERT_TRUE(scene.ok()) << name << ": " << scene.status().message();
    EXPECT_EQ(scene->name(), name);
    const auto built = to_physics(*scene);
    EXPECT_TRUE(built.ok()) << name << ": " << built.status().message();
  }
}

TEST(BuiltinScenes, FiveBallsIsThePapersFigureOne) {
  const auto scene = to_physics(*load_scene("five-balls"));
  ASSERT_TRUE(scene.ok());
  ASSERT_EQ(scene->soft_bodies.size(), 5U);
  for (const physics::SoftBody& ball : scene->soft_bodies) {
    EXPECT_EQ(ball.mesh->positions_m.size(), 162U);
    EXPECT_EQ(ball.mesh->faces.size(), 320U);
    EXPECT_TRUE(ball.gas.has_value());
  }
  ASSERT_EQ(scene->colliders.size(), 1U);
  EXPECT_TRUE(std::holds_alternative<physics::RoomShape>(scene->colliders[0].shape));
  EXPECT_NE(scene->colliders[0].angular_velocity, physics::Vec3d::Zero());
}

TEST(BuiltinScenes, HandIsClosedAndHitByARigidBall) {
  const auto scene = to_physics(*load_scene("hand"));
  ASSERT_TRUE(scene.ok());
  EXPECT_EQ(scene->soft_bodies[0].mesh->positions_m.size(), 1'159U);
  EXPECT_EQ(scene->soft_bodies[0].mesh->faces.size(), 2'314U);
  EXPECT_TRUE(scene->soft_bodies[0].mesh->closed);
  EXPECT_TRUE(std::holds_alternative<physics::SphereShape>(scene->rigid_bodies[0].shape));
}

/// A rigid body of that mesh over a floor.
base::Result<v1::Scene> with_rigid_mesh(const std::string& name) {
  std::ostringstream text;
  text << R"({"gravity": {"y": -9.81},
    "meshes": [{"name": "ball", "icosphere": {"subdivisions": 2}},
      {"name": "wedge", "triangles": {"positions": [{}, {"x": 1}, {"y": 1}, {"z": 1}],
        "indices": [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3]}},
      {"name": "dented", "triangles": {"positions": [{}, {"x": 1}, {"y": 1}, {"z": 1}, {"x": 0.2, "y": 0.2, "z": 0.2}],
        "indices": [0, 2, 1, 0, 1, 3, 2, 0, 3, 1, 2, 4, 2, 3, 4, 3, 1, 4]}},
      {"name": "open", "grid": {"columns": 1, "rows": 1}}],
    "rigid_bodies": [{"name": "stone", "shape": {"mesh": ")"
       << name << R"("}, "position": {"y": 0.8}, "velocity": {"x": 1}}],
    "colliders": [{"name": "floor", "shape": {"plane": {}}, "surface": {"friction": 0.5}}]})";
  return parse_scene_json(text.str());
}

TEST(ToPhysics, RigidBodyMayBeAConvexMeshOfTheScene) {
  const auto scene = to_physics(*with_rigid_mesh("wedge"));
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const auto& convex = std::get<physics::ConvexShape>(scene->rigid_bodies[0].shape);
  EXPECT_EQ(convex.name, "wedge");
  EXPECT_EQ(convex.mesh->faces.size(), 4U);
  EXPECT_EQ(scene->rigid_bodies[0].position, physics::Vec3d(0, 0.8, 0));
}

TEST(ToPhysics, RigidMeshThatIsNoneIsRefusedByBodyMeshAndPlace) {
  const auto refusal = [](const std::string& mesh) { return error_of(to_physics(*with_rigid_mesh(mesh))); };
  EXPECT_EQ(refusal("ball"),
            "rigid_bodies[0].shape.mesh: mesh \"ball\" of rigid body \"stone\" has 162 vertices; the mesh of a rigid "
            "body may have at most 64");
  EXPECT_EQ(refusal("open"),
            "rigid_bodies[0].shape.mesh: mesh \"open\" of rigid body \"stone\" is open at the edge from vertex 0 to "
            "vertex 2");
  EXPECT_EQ(refusal("dented"),
            "rigid_bodies[0].shape.mesh: mesh \"dented\" of rigid body \"stone\" is not convex: vertex 3 lies "
            "0.603022689 m above the plane of face 3");
  EXPECT_EQ(refusal("none"),
            "rigid_bodies[0].shape.mesh: no mesh is named \"none\"; meshes: ball, dented, open, wedge");
}

// The scene that a running world tells is the scene again, and goes the same way.
TEST(ToPhysics, RigidMeshGoesThereAndBackToTheSameHash) {
  const v1::Scene scene = *with_rigid_mesh("wedge");
  const auto hash_after = [](const v1::Scene& from, int ticks, v1::Scene* told) {
    auto world = physics::World::create(*to_physics(from));
    EXPECT_TRUE(world.ok()) << world.status().message();
    physics::Workers workers(1);
    for (int tick = 0; tick < ticks; ++tick) world->step_tick(workers);
    if (told != nullptr) *told = to_proto(world->scene(), from);
    return world->state_hash();
  };
  v1::Scene told;
  const std::uint64_t hash = hash_after(scene, 90, nullptr);
  hash_after(scene, 0, &told);
  EXPECT_EQ(told.rigid_bodies(0).shape().mesh(), "wedge");
  std::string text;
  ASSERT_TRUE(google::protobuf::util::MessageToJsonString(told, &text).ok());
  EXPECT_EQ(hash_after(*parse_scene_json(text), 90, nullptr), hash);
}

}  // namespace
}  // namespace pneuma::scene_io
