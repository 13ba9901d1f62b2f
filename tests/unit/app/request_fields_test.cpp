// Shows that numbers that are no numbers or absurd are refused by the field's name, and what a world may be called.
#include "app/request_fields.h"

#include <limits>

#include <gtest/gtest.h>

#include "base/limits.h"

namespace pneuma::app {
namespace {

TEST(RequestFields, AVectorsBadComponentIsNamed) {
  v1::Vec3 vector;
  EXPECT_TRUE(read_vector(vector, 1.0, "v").ok());
  vector.set_x(std::numeric_limits<double>::infinity());
  EXPECT_EQ(read_vector(vector, 1.0, "v").status().message(), "v.x: is not finite");
  vector.set_x(1.0);
  vector.set_z(-1.5);
  EXPECT_EQ(read_vector(vector, 1.0, "v").status().where(), "v.z");
}

TEST(RequestFields, ARadiusIsNotNegative) {
  v1::Impulse impulse;
  impulse.mutable_near()->set_radius_m(-0.1);
  EXPECT_EQ(read_at(impulse).status().where(), "impulse.near.radius_m");
}

TEST(RequestFields, ATinyDirectionIsADirection) {
  v1::Impulse impulse;
  impulse.mutable_ray()->mutable_direction()->set_y(1e-200);
  const auto at = read_at(impulse);
  ASSERT_TRUE(at.ok());
  EXPECT_NEAR(std::get<physics::RayPoint>(*at).direction.y(), 1.0, 1e-12);
}

TEST(RequestFields, AGrabMustNameAPoint) {
  EXPECT_EQ(read_at(v1::Grab()).status().where(), "grab.at");
}

TEST(RequestFields, WorldNamesAreFitForFilesAndLogs) {
  for (const std::string good : {"five-balls", "A.b_c-9", "w"}) EXPECT_TRUE(check_world_name(good, "n").ok()) << good;
  for (const std::string& bad :
       {std::string(), std::string(".."), std::string(".w"), std::string("a/b"), std::string("a b"),
        std::string("a\nb"), std::string("\xc3\xa4"), std::string(base::name_bytes_max + 1, 'x'),
        std::string(base::name_bytes_max, '.').replace(0, 1, "a")}) {
    EXPECT_EQ(check_world_name(bad, "n").where(), "n") << bad;
  }
}

TEST(RequestFields, EverySceneNameGivesAWorldName) {
  for (const std::string& name : {std::string("five balls"), std::string("../../etc"), std::string(),
                                  std::string("\xff"), std::string(1000, 'y'), std::string(1000, '.')}) {
    EXPECT_TRUE(check_world_name(to_world_name(name) + "-1024", "n").ok()) << name;
  }
}

}  // namespace
}  // namespace pneuma::app
