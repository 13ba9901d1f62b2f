// Shows what link a browser is given for each HTTP address a server may have.
#include "base/page_link.h"

#include <gtest/gtest.h>

namespace pneuma::base {
namespace {

TEST(PageLink, IsTheAddressWithItsSchemeAndThisMachineWhereAnyAddressIsMeant) {
  EXPECT_EQ(page_link("127.0.0.1:7421", false), "http://127.0.0.1:7421");
  EXPECT_EQ(page_link("[::1]:7421", true), "https://[::1]:7421");
  EXPECT_EQ(page_link("0.0.0.0:7421", false), "http://localhost:7421");
  EXPECT_EQ(page_link("[::]:7421", true), "https://localhost:7421");
  EXPECT_EQ(page_link("off", false), "");
}

TEST(PageLink, HttpIsBesideTheProtocolUnlessItIsSaid) {
  EXPECT_EQ(*http_beside("127.0.0.1:7420"), "127.0.0.1:7421");
  EXPECT_EQ(*http_beside("[::1]:7430"), "[::1]:7431");
  EXPECT_EQ(*http_beside("127.0.0.1:0"), "127.0.0.1:0");
  EXPECT_EQ(http_beside("127.0.0.1:65535").status().where(), "127.0.0.1:65535");
}

TEST(ReadyLine, NamesThePageWhereThereIsOne) {
  EXPECT_EQ(ready_line("127.0.0.1:7420", "127.0.0.1:7421", "http://127.0.0.1:7421"),
            "ready tcp=127.0.0.1:7420 http=127.0.0.1:7421 page=http://127.0.0.1:7421");
  EXPECT_EQ(ready_line("127.0.0.1:7420", "off", ""), "ready tcp=127.0.0.1:7420 http=off");
}

}  // namespace
}  // namespace pneuma::base
