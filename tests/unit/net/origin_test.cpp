// Shows which pages may open a WebSocket: those that this very host and port served, or that a loopback name of the
// same port did.
#include "net/origin.h"

#include <gtest/gtest.h>

namespace pneuma::net {
namespace {

TEST(SameOrigin, ThePageOfTheServerItself) {
  EXPECT_TRUE(is_same_origin("http://example.org:7421", "example.org:7421"));
  EXPECT_TRUE(is_same_origin("http://Example.org:7421", "example.ORG:7421"));
  EXPECT_TRUE(is_same_origin("http://[2001:db8::1]:7421", "[2001:db8::1]:7421"));
}

TEST(SameOrigin, APortLeftOutIsTheSchemes) {
  EXPECT_TRUE(is_same_origin("http://example.org", "example.org:80"));
  EXPECT_TRUE(is_same_origin("https://example.org:443", "example.org"));
  EXPECT_FALSE(is_same_origin("https://example.org", "example.org:80"));
}

TEST(SameOrigin, LoopbackNamesAreOneHost) {
  EXPECT_TRUE(is_same_origin("http://localhost:7421", "127.0.0.1:7421"));
  EXPECT_TRUE(is_same_origin("http://[::1]:7421", "localhost:7421"));
  EXPECT_FALSE(is_same_origin("http://localhost:8080", "127.0.0.1:7421"));
}

TEST(SameOrigin, PagesFromElsewhere) {
  EXPECT_FALSE(is_same_origin("http://evil.example", "127.0.0.1:7421"));
  EXPECT_FALSE(is_same_origin("http://evil.example:7421", "localhost:7421"));
  EXPECT_FALSE(is_same_origin("http://localhost:7421", "example.org:7421"));
  EXPECT_FALSE(is_same_origin("http://localhost.evil.example:7421", "localhost:7421"));
  EXPECT_FALSE(is_same_origin("null", "localhost:7421"));
  EXPECT_FALSE(is_same_origin("", "localhost:7421"));
  EXPECT_FALSE(is_same_origin("http://", ""));
}

TEST(AllowedHosts, AddressesAndLocalhostAlwaysAre) {
  const AllowedHosts none;
  for (const char* host :
       {"localhost", "LocalHost:7421", "127.0.0.1", "192.168.1.20:8080", "[::1]", "[2001:db8::1]:7421"}) {
    EXPECT_TRUE(none.allow(host)) << host;
  }
  for (const char* host : {"", ":7421", "evil.example", "evil.example:7421", "localhost.evil.example",
                           "127.0.0.1.evil.example", "0x7f000001", "[evil.example]", "::1", "1"}) {
    EXPECT_FALSE(none.allow(host)) << host;
  }
}

TEST(AllowedHosts, NamesAreThoseThatWereGiven) {
  const AllowedHosts hosts({"Pneuma.example"});
  EXPECT_TRUE(hosts.allow("pneuma.example:7421"));
  EXPECT_TRUE(hosts.allow("PNEUMA.EXAMPLE"));
  EXPECT_FALSE(hosts.allow("other.pneuma.example"));
  EXPECT_TRUE(AllowedHosts({"*"}).allow("anything.example"));
  EXPECT_FALSE(AllowedHosts({"*"}).allow(""));
}

}  // namespace
}  // namespace pneuma::net
