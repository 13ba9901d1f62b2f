// Shows that connections are counted in all and of each address, that places come back, and that refusals are bounded
// too.
#include "net/admission.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::net {
namespace {

base::Limits small_limits() {
  base::Limits limits;
  limits.connections_max = 3;
  limits.connections_per_address_max = 2;
  return limits;
}

TEST(Admission, AnAddressHasItsOwnLimit) {
  Admission admission(small_limits());
  const auto first = admission.admit("a");
  const auto second = admission.admit("a");
  EXPECT_FALSE(first->refused());
  EXPECT_FALSE(second->refused());
  EXPECT_TRUE(admission.admit("a")->refused());
  EXPECT_EQ(admission.admit("a")->refusal().what(), "your address has its 2 connections already; try again later");
  EXPECT_FALSE(admission.admit("b")->refused());
}

TEST(Admission, AllAddressesTogetherHaveALimit) {
  Admission admission(small_limits());
  const std::vector places{admission.admit("a"), admission.admit("b"), admission.admit("c")};
  EXPECT_TRUE(admission.admit("d")->refused());
  EXPECT_EQ(admission.admit("d")->refusal().what(), "the server has its 3 connections already; try again later");
}

TEST(Admission, APlaceComesBack) {
  Admission admission(small_limits());
  const auto stays = admission.admit("a");
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(admission.admit("a")->refused());
}

TEST(Admission, ARefusalTakesNoPlaceAndRefusalsAreBounded) {
  Admission admission(small_limits());
  const std::vector places{admission.admit("a"), admission.admit("a")};
  std::vector<std::shared_ptr<const Admission::Place>> refusals;
  for (std::size_t i = 0; i < refusals_per_address_max; ++i) {
    refusals.push_back(admission.admit("a"));
    ASSERT_NE(refusals.back(), nullptr);
  }
  EXPECT_EQ(admission.admit("a"), nullptr);
  const auto last = admission.admit("b");
  EXPECT_FALSE(last->refused());
  while (refusals.size() < refusals_max) {
    refusals.push_back(admission.admit(std::string("c").append(std::to_string(refusals.size()))));
    ASSERT_NE(refusals.back(), nullptr);
    EXPECT_TRUE(refusals.back()->refused());
  }
  EXPECT_EQ(admission.admit("d"), nullptr) << "of all addresses together";
  refusals.clear();
  EXPECT_NE(admission.admit("a"), nullptr);
}

}  // namespace
}  // namespace pneuma::net
