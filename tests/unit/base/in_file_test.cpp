// Shows how a failure of a file's text names the place.
#include "base/in_file.h"

#include <gtest/gtest.h>

namespace pneuma::base {
namespace {

TEST(InFile, ALineAndAColumnStandBehindItsNameAndAPathBeforeTheWords) {
  EXPECT_EQ(in_file(invalid("no valid JSON", "line 3, column 7"), "bad.json").message(), "bad.json:3:7: no valid JSON");
  EXPECT_EQ(in_file(invalid("is -1", "mass_kg"), "bad.json").message(), "bad.json: mass_kg: is -1");
  EXPECT_EQ(in_file(invalid("is empty"), "bad.json").message(), "bad.json: is empty");
}

}  // namespace
}  // namespace pneuma::base
