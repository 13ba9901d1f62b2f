// Shows that scenes and edits are read by protobuf's JSON mapping, both spellings of a name alike, and that everything
// wrong is refused with one line that names the field's full path, or the line and column where the text is no JSON.
#include "scene_io/json.h"

#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include "scene_io/load.h"

namespace pneuma::scene_io {
namespace {

using google::protobuf::util::MessageDifferencer;

const std::string fields_of_a_scene =
    "; there are name, gravity, stepping, atmosphere, meshes, soft_bodies, rigid_bodies, colliders, joints";

std::string scene_error(const std::string& text) {
  const auto scene = parse_scene_json(text);
  return scene.ok() ? "no error" : scene.status().message();
}

TEST(SceneJson, ReadsWhatProtobufsOwnReaderReads) {
  for (const std::string& name : builtin_scene_names()) {
    const auto ours = builtin_scene(name);
    ASSERT_TRUE(ours.ok()) << name << ": " << ours.status().message();
    std::string text;
    ASSERT_TRUE(google::protobuf::util::MessageToJsonString(*ours, &text).ok());
    v1::Scene theirs;
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(text, &theirs).ok());
    const auto again = parse_scene_json(text);  // lowerCamelCase
    ASSERT_TRUE(again.ok()) << again.status().message();
    EXPECT_TRUE(MessageDifferencer::Equals(*again, theirs)) << name;
    EXPECT_TRUE(MessageDifferencer::Equals(*again, *ours)) << name;
  }
}

TEST(SceneJson, TakesTheMappingsOtherForms) {
  const auto scene = parse_scene_json(
      R"({"softBodies": [{"massKg": "1.5", "pins": [1.0, "2"], "gas": null, "pressure_spread": 2}], "stepping": {"rate_hz": 1e2}})");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const v1::SoftBody& body = scene->soft_bodies(0);
  EXPECT_EQ(body.mass_kg(), 1.5);
  EXPECT_EQ(body.pins(1), 2U);
  EXPECT_FALSE(body.has_gas());
  EXPECT_EQ(body.pressure_spread(), v1::VERTEX_NORMALS);
  EXPECT_EQ(scene->stepping().rate_hz(), 100.0);
}

TEST(SceneJson, UnknownFieldIsNamedWithItsPathAndNeighbour) {
  EXPECT_EQ(scene_error(R"({"soft_bodies": [{}, {"springs": {"stifness_n_m": 1}}]})"),
            "soft_bodies[1].springs.stifness_n_m: unknown field; did you mean stiffness_n_m?");
  EXPECT_EQ(scene_error(R"({"gravity": {"zzzzzz": 1}})"), "gravity.zzzzzz: unknown field; there are x, y, z");
}

TEST(SceneJson, WrongTypesAreNamed) {
  EXPECT_EQ(scene_error(R"({"soft_bodies": [{"mass_kg": "heavy"}]})"),
            "soft_bodies[0].mass_kg: is the string \"heavy\"; a number is wanted");
  EXPECT_EQ(scene_error(R"({"soft_bodies": {}})"), "soft_bodies: is an object; a list is wanted");
  EXPECT_EQ(scene_error(R"({"gravity": [0, 1, 2]})"), "gravity: is a list; an object is wanted");
  EXPECT_EQ(scene_error(R"({"name": 5})"), "name: is a number; a string is wanted");
  EXPECT_EQ(scene_error(R"({"soft_bodies": [{"pin_boundary": 1}]})"),
            "soft_bodies[0].pin_boundary: is a number; true or false is wanted");
  EXPECT_EQ(scene_error(R"({"soft_bodies": [null]})"), "soft_bodies[0]: is null; an object is wanted");
  EXPECT_EQ(scene_error("[]"), "is a list; an object is wanted");
}

TEST(SceneJson, NumbersOutOfTheirTypesRangeAreNamed) {
  for (const char* pin : {"-1", "1.5", "4294967296"}) {
    EXPECT_EQ(scene_error(std::string(R"({"soft_bodies": [{"pins": [0, )") + pin + "]}]}").substr(0, 27),
              "soft_bodies[0].pins[1]: is ");
  }
}

TEST(SceneJson, NumbersThatAreNotFiniteAreNamed) {
  for (const char* value : {R"("NaN")", R"("Infinity")", R"("-Infinity")", "1e999"}) {
    EXPECT_EQ(scene_error(std::string(R"({"rigid_bodies": [{"velocity": {"y": )") + value + "}}]}"),
              "rigid_bodies[0].velocity.y: is not finite");
  }
}

TEST(SceneJson, TextFromOutsideIsCutAndEscapedInErrors) {
  EXPECT_EQ(scene_error(R"({"\u001b[31m\nx\u009b": 1})"),
            "\\x1b[31m\\x0ax\\xc2\\x9b: unknown field" + fields_of_a_scene);
  EXPECT_EQ(scene_error("{\"" + std::string(1'000'000, 'z') + "\": 1}"),
            std::string(40, 'z') + "...: unknown field" + fields_of_a_scene);
  // 39 bytes and a character of two: cut before it, not inside it.
  EXPECT_EQ(scene_error(R"({"gravity": ")" + std::string(39, 'z') + "\u00e9z\"}"),
            "gravity: is the string \"" + std::string(39, 'z') + "...\"; an object is wanted");
}

TEST(SceneJson, UnknownEnumNameListsTheNames) {
  EXPECT_EQ(scene_error(R"({"stepping": {"precision": "HALF"}})"),
            "stepping.precision: is the string \"HALF\"; one of SINGLE, DOUBLE is wanted");
  EXPECT_EQ(scene_error(R"({"stepping": {"precision": 7}})"),
            "stepping.precision: is a number; one of SINGLE, DOUBLE is wanted");
}

TEST(SceneJson, TwoOfAOneofAreRefused) {
  EXPECT_EQ(scene_error(R"({"meshes": [{"icosphere": {}, "asset": "hand"}]})"),
            "meshes[0].asset: stands beside icosphere; only one of them can be meant");
}

TEST(SceneJson, BothSpellingsOfAFieldAreRefused) {
  EXPECT_EQ(scene_error(R"({"soft_bodies": [], "softBodies": []})"), "soft_bodies: is given twice");
}

TEST(SceneJson, BrokenTextIsNamedByLineAndColumn) {
  EXPECT_EQ(scene_error("{\n  \"name\" \"x\"\n}").substr(0, 16), "line 2, column 1");
  EXPECT_NE(scene_error("").find("no valid JSON"), std::string::npos);
  EXPECT_NE(scene_error("{} {}").find("after the end"), std::string::npos);
  EXPECT_NE(scene_error(std::string(100'000, '[')).find("line 1"), std::string::npos);  // no deep recursion
  EXPECT_NE(scene_error("{\"name\": \"\xFF\"}").find("line 1"), std::string::npos);     // no UTF-8
}

TEST(EditJson, ReadsAndRefusesAlike) {
  const auto edit = parse_edit_json(R"({"changes": [{"set_gravity": {"y": -1.6}}, {"removeSoftBody": "ball"}]})");
  ASSERT_TRUE(edit.ok()) << edit.status().message();
  EXPECT_EQ(edit->changes(0).set_gravity().y(), -1.6);
  EXPECT_EQ(edit->changes(1).remove_soft_body(), "ball");
  EXPECT_EQ(parse_edit_json(R"({"changes": [{"set_gravty": {}}]})").status().message(),
            "changes[0].set_gravty: unknown field; did you mean set_gravity?");
}

}  // namespace
}  // namespace pneuma::scene_io
