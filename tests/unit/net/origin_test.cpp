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

}  // namespace
}  // namespace pneuma::net
