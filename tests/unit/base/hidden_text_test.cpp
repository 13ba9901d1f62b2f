// Shows which characters are said not to show as themselves, and that all others are let alone.
#include "base/hidden_text.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::base {
namespace {

TEST(HiddenText, ControlsAndWhatTurnsTextDoNotShow) {
  const std::vector<std::string> hidden{"\x1b",   "\n",     "\x7f",   "\u0085", "\u009b",
                                        "\u061c", "\u200e", "\u2028", "\u202e", "\u2066"};
  for (const std::string& mark : hidden) {
    EXPECT_EQ(hidden_bytes(mark, 0), mark.size());
    EXPECT_TRUE(has_hidden("ball" + mark));
    EXPECT_TRUE(has_hidden(mark + "ball"));
  }
}

TEST(HiddenText, LettersOfAnyScriptShow) {
  for (const char* const text : {"", "ball 1", "\u00fcber", "\u7403", "\u0643\u0631\u0629", "\U0001f388"}) {
    EXPECT_FALSE(has_hidden(text)) << text;
  }
}

// A sequence that is cut off is no character.
TEST(HiddenText, TheFirstByteAloneHidesNothing) {
  EXPECT_FALSE(has_hidden("\xc2"));
  EXPECT_FALSE(has_hidden("\xe2\x80"));
}

}  // namespace
}  // namespace pneuma::base
