// Shows that an edit changes what it names and nothing else, that fields it does not name stay, and that one change
// that cannot be made, named by its path, leaves the scene as it was.
#include "scene_io/edit.h"

#include <limits>
#include <vector>

#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include "base/limits.h"
#include "scene_io/edit_path.h"
#include "scene_io/json.h"
#include "scene_io/load.h"

namespace pneuma::scene_io {
namespace {

v1::Scene scene_before() {
  const auto scene = parse_scene_json(R"({
    "stepping": {"rate_hz": 50, "substeps": 4, "precision": "SINGLE"},
    "atmosphere": {"pressure_pa": 7, "wind": {"x": 1}},
    "meshes": [{"name": "ball", "icosphere": {"subdivisions": 1}}, {"name": "spare", "icosphere": {}}],
    "soft_bodies": [
      {"name": "a", "mesh": "ball", "mass_kg": 2, "pins": [1, 2], "pin_boundary": true,
       "springs": {"stiffness_n_m": 10, "damping_n_s_m": 1}, "gas": {"moles": 1, "flow_mol_s": 3}},
      {"name": "b", "mesh": "ball"}],
    "rigid_bodies": [{"name": "r", "shape": {"sphere": {"radius_m": 1}}, "position": {"x": 1, "y": 2, "z": 3}}],
    "colliders": [{"name": "c", "shape": {"plane": {}}, "surface": {"friction": 0.5}}]})");
  EXPECT_TRUE(scene.ok()) << scene.status().message();
  return *scene;
}

base::Result<v1::Scene> edit(const std::string& changes) {
  const auto parsed = parse_edit_json("{\"changes\": [" + changes + "]}");
  if (!parsed.ok()) return parsed.status();
  return apply_edit(scene_before(), *parsed);
}

std::string error_of(const base::Result<v1::Scene>& scene) {
  return scene.ok() ? "no error" : scene.status().message();
}

TEST(Edit, NoChangesGiveTheSameScene) {
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(*edit(""), scene_before()));
}

TEST(Edit, AddsAndRemovesInOrder) {
  const auto scene =
      edit(R"({"add_mesh": {"name": "m", "icosphere": {}}}, {"add_soft_body": {"name": "x", "mesh": "m"}},
    {"remove_soft_body": "a"}, {"add_soft_body": {"name": "a", "mesh": "m"}}, {"remove_rigid_body": "r"},
    {"add_collider": {"name": "r"}}, {"remove_collider": "c"}, {"remove_mesh": "spare"},
    {"add_rigid_body": {"name": "c"}})");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  ASSERT_EQ(scene->soft_bodies_size(), 3);
  EXPECT_EQ(scene->soft_bodies(0).name(), "b");
  EXPECT_EQ(scene->soft_bodies(1).name(), "x");
  EXPECT_EQ(scene->soft_bodies(2).mesh(), "m");
  EXPECT_EQ(scene->meshes_size(), 2);
  EXPECT_EQ(scene->rigid_bodies(0).name(), "c");
  EXPECT_EQ(scene->colliders(0).name(), "r");
}

TEST(Edit, ChangesOfASoftBodyMergeFieldByField) {
  const auto scene = edit(R"({"change_soft_body": {"name": "a", "springs": {"stiffness_n_m": 20}, "gas": {"moles": 5},
    "surface": {"friction": 1}}})");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const v1::SoftBody& body = scene->soft_bodies(0);
  EXPECT_EQ(body.springs().stiffness_n_m(), 20.0);
  EXPECT_EQ(body.springs().damping_n_s_m(), 1.0);
  EXPECT_EQ(body.gas().moles(), 5.0);
  EXPECT_EQ(body.gas().flow_mol_s(), 3.0);
  EXPECT_EQ(body.surface().friction(), 1.0);
  EXPECT_EQ(body.mass_kg(), 2.0);
  EXPECT_EQ(body.pins_size(), 2);
}

TEST(Edit, FieldSetToZeroIsSet) {
  const auto scene =
      edit(R"({"change_soft_body": {"name": "a", "springs": {"damping_n_s_m": 0}, "gas": {"flow_mol_s": 0}}})");
  ASSERT_TRUE(scene.ok());
  EXPECT_EQ(scene->soft_bodies(0).springs().damping_n_s_m(), 0.0);
  EXPECT_EQ(scene->soft_bodies(0).gas().flow_mol_s(), 0.0);
}

TEST(Edit, ANewVolumeMethodBeginsWithItsOwnResolution) {
  const std::string cells =
      R"({"change_soft_body": {"name": "a", "volume": {"method": "SUBDIVIDED", "resolution": 32}}},)";
  const auto samples = edit(cells + R"({"change_soft_body": {"name": "a", "volume": {"method": "MONTE_CARLO"}}})");
  ASSERT_TRUE(samples.ok()) << samples.status().message();
  EXPECT_FALSE(samples->soft_bodies(0).volume().has_resolution());
  const auto same = edit(cells + R"({"change_soft_body": {"name": "a", "volume": {"method": "SUBDIVIDED"}}})");
  ASSERT_TRUE(same.ok()) << same.status().message();
  EXPECT_EQ(same->soft_bodies(0).volume().resolution(), 32U);
}

TEST(Edit, FactorsOfStiffnessStayOrAreReplacedWhole) {
  const std::string given = R"({"change_soft_body": {"name": "a", "springs": {"vertex_stiffness_scale": [1, 2, 3]}}},)";
  const auto kept = edit(given + R"({"change_soft_body": {"name": "a", "springs": {"stiffness_n_m": 20}}})");
  ASSERT_TRUE(kept.ok()) << kept.status().message();
  const auto factors = [](const auto& scene) {
    const auto& list = scene->soft_bodies(0).springs().vertex_stiffness_scale();
    return std::vector<double>(list.begin(), list.end());
  };
  EXPECT_EQ(factors(kept), (std::vector<double>{1.0, 2.0, 3.0}));
  EXPECT_EQ(kept->soft_bodies(0).springs().stiffness_n_m(), 20.0);
  const auto replaced =
      edit(given + R"({"change_soft_body": {"name": "a", "springs": {"vertex_stiffness_scale": [5, 6]}}})");
  ASSERT_TRUE(replaced.ok()) << replaced.status().message();
  EXPECT_EQ(factors(replaced), (std::vector<double>{5.0, 6.0}));
  EXPECT_EQ(replaced->soft_bodies(0).springs().stiffness_n_m(), 10.0);
}

TEST(Edit, PinsAreReplacedWhole) {
  const auto scene = edit(R"({"change_soft_body": {"name": "a", "pins": {"vertices": [7]}}})");
  ASSERT_TRUE(scene.ok());
  ASSERT_EQ(scene->soft_bodies(0).pins_size(), 1);
  EXPECT_EQ(scene->soft_bodies(0).pins(0), 7U);
  EXPECT_FALSE(scene->soft_bodies(0).pin_boundary());
}

TEST(Edit, VertexMassesAreReplacedWholeAndOutliveAChangeOfTheMass) {
  const std::string given = R"({"change_soft_body": {"name": "a", "vertex_mass_scale": {"scale": [1, 2]}}})";
  const auto scene = edit(given + R"(, {"change_soft_body": {"name": "a", "mass_kg": 9}})");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  ASSERT_EQ(scene->soft_bodies(0).vertex_mass_scale_size(), 2);
  EXPECT_EQ(scene->soft_bodies(0).vertex_mass_scale(1), 2.0);
  const auto even = edit(given + R"(, {"change_soft_body": {"name": "a", "vertex_mass_scale": {}}})");
  ASSERT_TRUE(even.ok()) << even.status().message();
  EXPECT_EQ(even->soft_bodies(0).vertex_mass_scale_size(), 0);
}

TEST(Edit, GasIsAddedAndRemoved) {
  const auto scene = edit(R"({"change_soft_body": {"name": "b", "gas": {"moles": 2}}},
                             {"change_soft_body": {"name": "a", "remove_gas": true}})");
  ASSERT_TRUE(scene.ok());
  EXPECT_EQ(scene->soft_bodies(1).gas().moles(), 2.0);
  EXPECT_FALSE(scene->soft_bodies(0).has_gas());
  EXPECT_EQ(error_of(edit(R"({"change_soft_body": {"name": "a", "remove_gas": true, "gas": {}}})")),
            "changes[0].change_soft_body.remove_gas: stands beside gas");
}

TEST(Edit, VectorsAndShapesAreOneValue) {
  const auto scene = edit(R"({"change_rigid_body": {"name": "r", "position": {"y": 9}}},
    {"change_collider": {"name": "c", "shape": {"box": {"half_extents": {"x": 1, "y": 1, "z": 1}}}, "surface": {"restitution": 1}}})");
  ASSERT_TRUE(scene.ok());
  EXPECT_EQ(scene->rigid_bodies(0).position().x(), 0.0);
  EXPECT_EQ(scene->rigid_bodies(0).position().y(), 9.0);
  EXPECT_TRUE(scene->rigid_bodies(0).shape().has_sphere());
  EXPECT_TRUE(scene->colliders(0).shape().has_box());
  EXPECT_EQ(scene->colliders(0).surface().friction(), 0.5);
}

TEST(Edit, LockedAxesAreReplacedWholeAndFreedByNone) {
  const std::string lock = R"({"change_rigid_body": {"name": "r", "locked": {"translation": {"x": true}}}})";
  const auto again = [&](const std::string& locked) {
    return edit(lock + R"(, {"change_rigid_body": {"name": "r", "locked": )" + locked + "}}");
  };
  EXPECT_TRUE(edit(lock)->rigid_bodies(0).locked().translation().x());
  EXPECT_EQ(edit(lock)->rigid_bodies(0).position().y(), 2.0);
  EXPECT_FALSE(again(R"({"rotation": {"y": true}})")->rigid_bodies(0).locked().translation().x());
  EXPECT_TRUE(again(R"({"rotation": {"y": true}})")->rigid_bodies(0).locked().rotation().y());
  EXPECT_EQ(again("{}")->rigid_bodies(0).locked().ByteSizeLong(), 0U);
}

TEST(Edit, AMeshThatAColliderIsMadeOfStays) {
  EXPECT_EQ(error_of(edit(R"({"add_collider": {"name": "x", "shape": {"mesh": "spare"}}}, {"remove_mesh": "spare"})")),
            "changes[1].remove_mesh: collider \"x\" is made of it");
  EXPECT_EQ(
      error_of(edit(R"({"add_rigid_body": {"name": "x", "shape": {"mesh": "spare"}}}, {"remove_mesh": "spare"})")),
      "changes[1].remove_mesh: rigid body \"x\" is made of it");
}

TEST(Edit, SurroundingsAndSteppingAreSet) {
  const auto scene =
      edit(R"({"set_gravity": {"y": -1}}, {"set_wind": {"z": 4}}, {"set_stepping": {"integrator": "RK4"}})");
  ASSERT_TRUE(scene.ok());
  EXPECT_EQ(scene->gravity().y(), -1.0);
  EXPECT_EQ(scene->atmosphere().wind().x(), 0.0);
  EXPECT_EQ(scene->atmosphere().wind().z(), 4.0);
  EXPECT_EQ(scene->atmosphere().pressure_pa(), 7.0);
  EXPECT_EQ(scene->stepping().integrator(), v1::Stepping::RK4);
  EXPECT_EQ(scene->stepping().substeps(), 4U);
  EXPECT_EQ(edit(R"({"set_atmosphere": {"density_kg_m3": 1}})")->atmosphere().pressure_pa(), 0.0);
}

TEST(Edit, PrecisionOfARunningWorldStays) {
  EXPECT_EQ(error_of(edit(R"({"set_stepping": {"precision": "DOUBLE"}})")),
            "changes[0].set_stepping.precision: a running world keeps its precision");
  EXPECT_TRUE(edit(R"({"set_stepping": {"precision": "SINGLE"}})").ok());
}

TEST(Edit, WhatCannotBeMadeIsNamedByPath) {
  const std::string good = R"({"set_gravity": {}}, )";
  EXPECT_EQ(error_of(edit(good + R"({"change_soft_body": {"name": "x"}})")),
            "changes[1].change_soft_body.name: no soft body is named \"x\"; there are a, b");
  EXPECT_EQ(error_of(edit(good + R"({"remove_collider": "a"})")),
            "changes[1].remove_collider: no collider is named \"a\"; there is c");
  EXPECT_EQ(error_of(edit(R"({"add_rigid_body": {"name": "a"}})")), "changes[0].add_rigid_body.name: \"a\" is taken");
  EXPECT_EQ(error_of(edit(R"({"add_mesh": {}})")), "changes[0].add_mesh.name: is empty");
  EXPECT_EQ(error_of(edit(R"({"remove_mesh": "ball"})")), "changes[0].remove_mesh: soft body \"a\" is made of it");
  EXPECT_EQ(error_of(edit("{}")), "changes[0]: holds no change");
}

TEST(Edit, AddsAreBounded) {
  v1::SceneEdit edit;
  for (std::size_t i = 0; i <= base::world_bodies_max; ++i) {
    edit.add_changes()->mutable_add_soft_body()->set_name(std::to_string(i));
  }
  const auto scene = apply_edit(v1::Scene(), edit);
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.status().code(), base::StatusCode::limit_exceeded);
  EXPECT_EQ(scene.status().where(), "changes[1024].add_soft_body");
}

TEST(Edit, ANumberThatIsNoneIsRefusedEvenWhereALaterChangeOverwritesIt) {
  v1::SceneEdit wind;
  wind.add_changes()->mutable_set_atmosphere()->mutable_wind()->set_x(std::numeric_limits<double>::quiet_NaN());
  wind.add_changes()->mutable_set_wind()->set_z(1.0);
  EXPECT_EQ(error_of(apply_edit(scene_before(), wind)), "changes[0].set_atmosphere.wind.x: is not finite");

  v1::SceneEdit mesh;
  auto& triangles = *mesh.add_changes()->mutable_add_mesh()->mutable_triangles();
  triangles.add_positions();
  triangles.add_positions()->set_y(std::numeric_limits<double>::infinity());
  EXPECT_EQ(error_of(apply_edit(scene_before(), mesh)), "changes[0].add_mesh.triangles.positions[1].y: is not finite");
}

TEST(RenewedBodies, AreThoseAddedAndTheRigidOnesWhoseMotionIsSet) {
  const auto renewed = [](const std::string& changes) {
    return renewed_bodies(*parse_edit_json("{\"changes\": [" + changes + "]}"));
  };
  EXPECT_EQ(
      renewed(R"({"remove_soft_body": "a"}, {"add_soft_body": {"name": "a"}}, {"add_rigid_body": {"name": "x"}})"),
      (std::vector<std::string>{"a", "x"}));
  for (const char* field : {"position", "orientation", "velocity", "angular_velocity"}) {
    EXPECT_EQ(renewed(std::string(R"({"change_rigid_body": {"name": "r", ")").append(field).append(R"(": {}}})")),
              std::vector<std::string>{"r"})
        << field;
  }
  EXPECT_TRUE(renewed(R"({"change_rigid_body": {"name": "r", "mass_kg": 2}}, {"remove_soft_body": "b"},
    {"change_soft_body": {"name": "a", "mass_kg": 2}}, {"add_collider": {"name": "d"}}, {"set_gravity": {}})")
                  .empty());
}

/// What by_change makes of an error at `where` of the edited scene.
base::Status by_change_at(const std::string& where, const std::string& changes) {
  const auto parsed = parse_edit_json("{\"changes\": [" + changes + "]}");
  EXPECT_TRUE(parsed.ok()) << parsed.status().message();
  const auto edited = apply_edit(scene_before(), *parsed);
  EXPECT_TRUE(edited.ok()) << edited.status().message();
  return by_change(base::invalid("is bad", where), *edited, *parsed);
}

TEST(ByChange, AnErrorOfTheSceneIsFoundInTheChangeThatBroughtIt) {
  const std::string body = R"({"add_soft_body": {"name": "new", "mesh": "none"}})";
  EXPECT_EQ(by_change_at("soft_bodies[2].mesh", body).message(), "changes[0].add_soft_body.mesh: is bad");
  EXPECT_EQ(by_change_at("soft_bodies[2].mass_kg", body).where(), "changes[0].add_soft_body.mass_kg")
      << "a default is the addition's too";
  EXPECT_EQ(by_change_at("soft_bodies[2]", body).where(), "changes[0].add_soft_body");
  EXPECT_EQ(
      by_change_at("meshes[2].triangles.indices[9..11]", R"({"add_mesh": {"name": "m", "triangles": {}}})").where(),
      "changes[0].add_mesh.triangles.indices[9..11]");
  EXPECT_EQ(by_change_at("rigid_bodies[0].mass_kg", R"({"change_rigid_body": {"name": "r", "mass_kg": 9}})").where(),
            "changes[0].change_rigid_body.mass_kg");
  EXPECT_EQ(by_change_at("colliders[0].shape.sphere.radius_m",
                         R"({"change_collider": {"name": "c", "shape": {"sphere": {}}}})")
                .where(),
            "changes[0].change_collider.shape.sphere.radius_m");
  EXPECT_EQ(by_change_at("gravity.y", R"({"set_gravity": {"y": 1}})").where(), "changes[0].set_gravity.y");
  EXPECT_EQ(by_change_at("stepping.substeps", R"({"set_stepping": {"substeps": 9}})").where(),
            "changes[0].set_stepping.substeps");
  EXPECT_EQ(by_change_at("atmosphere.wind.z", R"({"set_wind": {"z": 1}})").where(), "changes[0].set_wind.z");
  EXPECT_EQ(by_change_at("atmosphere.wind.z", R"({"set_atmosphere": {"wind": {"z": 1}}})").where(),
            "changes[0].set_atmosphere.wind.z");
}

TEST(ByChange, VertexMassesAreAListInAMessage) {
  const std::string masses = R"({"change_soft_body": {"name": "a", "vertex_mass_scale": {"scale": [1, 0]}}})";
  EXPECT_EQ(by_change_at("soft_bodies[0].vertex_mass_scale[1]", masses).where(),
            "changes[0].change_soft_body.vertex_mass_scale.scale[1]");
}

TEST(ByChange, PinsHaveOtherNamesInAChange) {
  const std::string pins = R"({"change_soft_body": {"name": "a", "pins": {"vertices": [1, 99], "boundary": true}}})";
  EXPECT_EQ(by_change_at("soft_bodies[0].pins[1]", pins).where(), "changes[0].change_soft_body.pins.vertices[1]");
  EXPECT_EQ(by_change_at("soft_bodies[0].pin_boundary", pins).where(), "changes[0].change_soft_body.pins.boundary");
}

TEST(ByChange, TheLastChangeThatSetsTheFieldIsMeant) {
  const std::string changes = R"({"change_soft_body": {"name": "a", "mass_kg": 1}},
                                 {"change_soft_body": {"name": "a", "mass_kg": 3}},
                                 {"change_soft_body": {"name": "a", "drag": {"normal": 1}}},
                                 {"change_soft_body": {"name": "b", "mass_kg": 5}})";
  EXPECT_EQ(by_change_at("soft_bodies[0].mass_kg", changes).where(), "changes[1].change_soft_body.mass_kg");
}

TEST(ByChange, WhatNoChangeHoldsIsToldByTheScenesOwnPath) {
  const base::Status status = by_change_at("soft_bodies[0]", R"({"set_stepping": {"rate_hz": 1}})");
  EXPECT_EQ(status.where(), "");
  EXPECT_EQ(status.what(), "soft_bodies[0]: is bad");
}

}  // namespace
}  // namespace pneuma::scene_io
