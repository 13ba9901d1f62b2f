// Shows that text from outside shows as it is: what a terminal or a reader would take for something else is spelled
// out.
#include "scene_io/quoted.h"

#include <string>

#include <gtest/gtest.h>

namespace pneuma::scene_io {
namespace {

TEST(Escaped, LettersOfAnyLanguageStay) {
  for (const std::string text : {"five-balls", "\xc3\xa4", "\xd8\xa7", "\xe2\x80\xa6", "\xf0\x9f\x8e\x88"}) {
    EXPECT_EQ(escaped(text), text);
  }
}

TEST(Escaped, WhatDoesNotShowIsSpelledOut) {
  EXPECT_EQ(escaped("a\tb\x7f"), "a\\x09b\\x7f");
  EXPECT_EQ(escaped("\xc2\x9b"), "\\xc2\\x9b") << "U+009B, a control to a terminal";
  EXPECT_EQ(escaped("\xd8\x9c"), "\\xd8\\x9c") << "U+061C, an Arabic letter mark";
  EXPECT_EQ(escaped("\xe2\x80\xae"
                    "cod"),
            "\\xe2\\x80\\xae"
            "cod")
      << "U+202E, right to left";
  EXPECT_EQ(escaped("\xe2\x80\xa8"), "\\xe2\\x80\\xa8") << "U+2028, a line end";
  EXPECT_EQ(escaped("\xe2\x81\xa6"), "\\xe2\\x81\\xa6") << "U+2066, isolates what follows";
  EXPECT_EQ(escaped("\xef\xbb\xbf"), "\\xef\\xbb\\xbf") << "U+FEFF, of no width";
  EXPECT_EQ(escaped("\xf3\xa0\x81\x81"), "\\xf3\\xa0\\x81\\x81") << "U+E0041, a tag";
}

}  // namespace
}  // namespace pneuma::scene_io
