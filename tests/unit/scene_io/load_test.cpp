// Shows that scenes come by name or from a file, that a field can be set by its path, and how both refuse.
#include "scene_io/load.h"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "scene_io/obj.h"
#include "scene_io/set_path.h"
#include "support/temporary_folder.h"

namespace pneuma::scene_io {
namespace {

TEST(LoadScene, FileIsReadAndNamesANamelessScene) {
  const support::TemporaryFolder folder;
  std::ofstream(folder / "mine.json") << R"({"gravity": {"y": -3}})";
  const auto scene = load_scene(folder / "mine.json");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  EXPECT_EQ(scene->name(), "mine");
  EXPECT_EQ(scene->gravity().y(), -3.0);
}

TEST(LoadScene, MissingFileIsNamedWithTheBuiltInScenes) {
  const auto scene = load_scene("five-bals");
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.status().code(), base::StatusCode::not_found);
  EXPECT_EQ(scene.status().where(), "five-bals");
  EXPECT_NE(scene.status().message().find("five-balls, five-balls-paper, hand"), std::string::npos);
}

TEST(LoadScene, FolderAndBadFileAreNamed) {
  const support::TemporaryFolder folder;
  EXPECT_EQ(load_scene(folder.path()).status().message(), folder.path() + ": is not a file");
  std::ofstream(folder / "bad.json") << R"({"gravty": {}})";
  EXPECT_EQ(load_scene(folder / "bad.json").status().message(),
            (folder / "bad.json") + ": gravty: unknown field; did you mean gravity?");
}

TEST(LoadScene, FileThatCannotBeReachedIsNotMissing) {
  const support::TemporaryFolder folder;
  std::filesystem::create_symlink("loop", folder / "loop");
  EXPECT_EQ(load_scene(folder / "loop").status().code(), base::StatusCode::unavailable);
  EXPECT_TRUE(load_scene(folder / "loop").status().message().starts_with((folder / "loop") + ": cannot read: "));
}

TEST(LoadScene, LargeFileIsRefusedUnread) {
  const support::TemporaryFolder folder;
  std::ofstream(folder / "large.json").flush();
  std::filesystem::resize_file(folder / "large.json", base::scene_file_bytes_max + 1);
  EXPECT_EQ(load_scene(folder / "large.json").status().code(), base::StatusCode::limit_exceeded);
}

class SetPath : public testing::Test {
 protected:
  std::string error(const std::string& assignment) {
    const base::Status status = set_path(scene_, assignment);
    return status.ok() ? "no error" : status.message();
  }
  v1::Scene scene_ = *load_scene("five-balls");
};

TEST_F(SetPath, SetsByIndexByNameAndThroughUnsetMessages) {
  EXPECT_EQ(error("soft_bodies[1].gas.moles=0.5"), "no error");
  EXPECT_EQ(error("soft_bodies.ball-3.gas.moles=0.25"), "no error");
  EXPECT_EQ(error("atmosphere.wind.x=2"), "no error");
  EXPECT_EQ(error("softBodies[0].pins=[1, 2]"), "no error");
  EXPECT_EQ(error("stepping.integrator=RK4"), "no error");
  EXPECT_EQ(error("name=other"), "no error");
  EXPECT_EQ(error("gravity=null"), "no error");
  EXPECT_EQ(error("colliders.room.shape={\"sphere\": {\"radius_m\": 3}}"), "no error");
  EXPECT_EQ(scene_.soft_bodies(1).gas().moles(), 0.5);
  EXPECT_EQ(scene_.soft_bodies(2).gas().moles(), 0.25);
  EXPECT_EQ(scene_.atmosphere().wind().x(), 2.0);
  EXPECT_EQ(scene_.soft_bodies(0).pins(1), 2U);
  EXPECT_EQ(scene_.stepping().integrator(), v1::Stepping::RK4);
  EXPECT_EQ(scene_.name(), "other");
  EXPECT_FALSE(scene_.has_gravity());
  EXPECT_TRUE(scene_.colliders(0).shape().has_sphere());
}

TEST_F(SetPath, RefusesAndLeavesTheSceneAlone) {
  const std::string before = scene_.SerializeAsString();
  EXPECT_EQ(error("soft_bodies[9].mass_kg=1"), "soft_bodies: there is no item 9; the list has 5");
  EXPECT_EQ(error("soft_bodies.ball.mass_kg=1"),
            "soft_bodies.ball: nothing is named \"ball\"; there are: ball-1, ball-2, ball-3, ball-4, ball-5");
  EXPECT_EQ(error("gravty.y=1"), "gravty: unknown field; did you mean gravity?");
  EXPECT_EQ(error("gravity.y=down"), "gravity.y: is the string \"down\"; a number is wanted");
  EXPECT_EQ(error("name.x=1"), "name: has no fields in it");
  EXPECT_EQ(error("soft_bodies[0].pins[0]=1"), "soft_bodies[0].pins: can only be set as a whole list");
  EXPECT_EQ(error("soft_bodies[0]=1"), "soft_bodies[0]: a dot and a field's name are missing");
  EXPECT_EQ(error("soft_bodies[0x].mass_kg=1"), "soft_bodies: an index in brackets is wanted");
  EXPECT_EQ(error("soft_bodies[0.mass_kg=1"), "soft_bodies: an index in brackets is wanted");
  EXPECT_EQ(error("colliders.room.shape={\"sphere\": {\"radus_m\": 3}}"),
            "colliders.room.shape.sphere.radus_m: unknown field; did you mean radius_m?");
  EXPECT_EQ(error("no assignment"), "no assignment: PATH=VALUE is wanted");
  EXPECT_EQ(error("=1"), "=1: PATH=VALUE is wanted");
  EXPECT_EQ(scene_.SerializeAsString(), before);
}

TEST(Obj, ReadsVerticesAndFacesAndSkipsTheRest) {
  const auto mesh = parse_obj("# a face\no thing\nv 0 0 0\r\nv 1 0 0\nvn 0 0 1\nv\t0 1e0 -0.5 1\nf 1/1/1 2//1 3\n");
  ASSERT_TRUE(mesh.ok()) << mesh.status().message();
  ASSERT_EQ(mesh->positions_m.size(), 3U);
  EXPECT_EQ(mesh->positions_m[2], Eigen::Vector3d(0, 1, -0.5));
  ASSERT_EQ(mesh->faces.size(), 1U);
  EXPECT_EQ(mesh->faces[0], (physics::Face{0, 1, 2}));
}

TEST(Obj, BadLinesAreNumbered) {
  EXPECT_EQ(parse_obj("v 0 0 0\nv 1 0\n").status().message(), "line 2: a vertex needs three numbers");
  for (const char* face : {"f 1 2", "f 1 2 3 4", "f 0 1 2", "f -1 2 3", "f a b c"}) {
    EXPECT_EQ(parse_obj(face).status().message(), "line 1: a face needs three positive indices") << face;
  }
}

}  // namespace
}  // namespace pneuma::scene_io
