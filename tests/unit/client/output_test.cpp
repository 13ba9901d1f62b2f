// Shows what of a hostile text gets to a terminal.
#include "command/output.h"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::client {
namespace {

TEST(Output, WhatDoesNotShowIsEscapedAsInJson) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"two\nlines\tand a tab, \u00fcber", "two\\u000alines\\u0009and a tab, \u00fcber"},
      {"\x1b[2J", "\\u001b[2J"},
      {"a\rb", "a\\u000db"},
      {"\u009b31m", "\\u009b31m"},
      {"\u202e", "\\u202e"},
      {"\U000e0041", "\\udb40\\udc41"},
  };
  for (const auto& [text, expected] : cases) EXPECT_EQ(shown(text), expected);
  EXPECT_EQ(shown("two\nlines\tand a tab\x1b", LineEnds::kept), "two\nlines\tand a tab\\u001b");
}

TEST(Output, CellsOfATableAreEscapedAndItsColoursAreNot) {
  Table table({"world"});
  table.add({"\x1b[31mred"}, Style::red);
  const std::vector<std::string> lines = table.lines(true);
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[1], styled("\\u001b[31mred", Style::red));
}

}  // namespace
}  // namespace pneuma::client
