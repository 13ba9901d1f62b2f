// Shows that a scene or edit that says the same thing twice is refused, by the path of the key, however it is spelt.
#include "scene_io/duplicate_keys.h"

#include <string>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "scene_io/json.h"
#include "scene_io/set_path.h"

namespace pneuma::scene_io {
namespace {

TEST(DuplicateKeys, AreNamedWithTheirPath) {
  EXPECT_EQ(check_keys(R"({"name": "a", "name": "a"})").message(), "name: is given twice");
  EXPECT_EQ(check_keys(R"({"bodies": [{"name": "a", "pins": [1, 2]}, {"mass": 1, "gas": {}, "mass": 2}]})").message(),
            "bodies[1].mass: is given twice");
  EXPECT_EQ(check_keys(R"({"a": {"b": [[{}, {"c": null, "c": true}]]}})").where(), "a.b[0][1].c");
  EXPECT_EQ(check_keys(R"({"name": "a", "na\u006de": "b"})").where(), "name") << "however it is spelt";
}

TEST(DuplicateKeys, OfOtherObjectsAreNone) {
  EXPECT_TRUE(check_keys(R"({"a": {"name": 1}, "b": [{"name": 1}, {"name": 2}], "name": "name"})").ok());
  EXPECT_TRUE(check_keys(R"([1, "two", -3.5, true, null, []])").ok());
}

TEST(DuplicateKeys, NoSceneNorEditHasThem) {
  EXPECT_EQ(parse_scene_json(R"({"soft_bodies": [{"mass_kg": 1, "mass_kg": 2}]})").status().message(),
            "soft_bodies[0].mass_kg: is given twice");
  EXPECT_EQ(parse_edit_json(R"({"changes": [{}, {"set_gravity": {"y": 1, "y": 2}}]})").status().message(),
            "changes[1].set_gravity.y: is given twice");
  v1::Scene scene;
  EXPECT_EQ(set_path(scene, R"(gravity={"y": 1, "y": 2})").message(), "gravity.y: is given twice");
}

TEST(DuplicateKeys, MoreObjectsThanAnySceneNeedsAreRefused) {
  const auto list = [](std::size_t objects) {
    std::string text = "[{}";
    for (std::size_t i = 1; i < objects; ++i) text += ",{}";
    return text + "]";
  };
  EXPECT_TRUE(check_keys(list(base::json_objects_max)).ok());
  EXPECT_EQ(check_keys(list(base::json_objects_max + 1)).code(), base::StatusCode::limit_exceeded);
}

TEST(DuplicateKeys, MoreValuesThanAnySceneNeedsAreRefused) {
  const auto list = [](std::size_t numbers) {
    std::string text = "[0";
    for (std::size_t i = 1; i < numbers; ++i) text += ",0";
    return text + "]";
  };
  EXPECT_TRUE(check_keys(list(4 * base::json_objects_max - 1)).ok()) << "the list is one of them";
  EXPECT_EQ(check_keys(list(4 * base::json_objects_max)).code(), base::StatusCode::limit_exceeded);
}

TEST(DuplicateKeys, MoreKeysThanAnyMessageHasAreRefused) {
  std::string text = R"({"k0": 0)";
  for (int i = 1; i < 256; ++i) text.append(", \"k").append(std::to_string(i)).append("\": 0");
  EXPECT_TRUE(check_keys(text + "}").ok());
  EXPECT_EQ(check_keys(text + R"(, "k256": 0})").code(), base::StatusCode::limit_exceeded);
}

// Text that is too much is not read on, whatever comes behind it.
TEST(DuplicateKeys, TooMuchIsToldBeforeTheTextIsReadToItsEnd) {
  std::string text = "[{}";
  for (std::size_t i = 0; i < base::json_objects_max; ++i) text += ",{}";
  EXPECT_EQ(parse_scene_json(text).status().code(), base::StatusCode::limit_exceeded);
}

}  // namespace
}  // namespace pneuma::scene_io
