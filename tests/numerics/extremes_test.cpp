// Each extreme case of the report comes out as it is known to.
#include <gtest/gtest.h>

#include "numerics/extremes/extreme_case.h"

namespace pneuma::extremes {
namespace {

class Extreme : public testing::TestWithParam<ExtremeCase> {};

TEST_P(Extreme, ComesOutAsExpected) {
  const ExtremeCase& extreme = GetParam();
  const Result result = extreme.run(true);
  EXPECT_EQ(result.holds, extreme.holds) << extreme.name << ": " << extreme.criterion << "; " << result.figure;
}

std::string test_name(const testing::TestParamInfo<ExtremeCase>& info) {
  return std::string("Case").append(std::to_string(info.param.number));
}

INSTANTIATE_TEST_SUITE_P(Cases, Extreme, testing::ValuesIn(extreme_cases()), test_name);

}  // namespace
}  // namespace pneuma::extremes
