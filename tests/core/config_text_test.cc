#include "core/config_text.h"

#include <gtest/gtest.h>

#include <string>

namespace trn {
namespace {

std::string place_of_flaw(std::string_view text) {
  const auto flaw = find_encoding_flaw(text);
  return flaw ? std::to_string(flaw->line) + ":" + std::to_string(flaw->column) + ": " + flaw->why : "";
}

// Unicode 15, table 3-7: the least and the greatest of each length, and what lies between them.
TEST(ConfigText, WhatIsUtf8AndWhatIsNot) {
  for (const char* good :
       {"", "plain\n", "\xC2\x80\xDF\xBF", "\xE0\xA0\x80\xED\x9F\xBF\xEE\x80\x80\xEF\xBF\xBF",
        "\xF0\x90\x80\x80\xF4\x8F\xBF\xBF"})
    EXPECT_EQ(place_of_flaw(good), "") << good;
  for (const char* bad : {"\x80", "\xC0\x80", "\xC1\xBF", "\xC2", "\xC2z", "\xE0\x9F\xBF", "\xED\xA0\x80",
                          "\xE2\x82", "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFF"})
    EXPECT_EQ(place_of_flaw(bad).substr(0, 5), "1:1: ") << bad;
}

TEST(ConfigText, ACutTextKeepsWholeLetters) {
  const std::string text = "a\xC3\xBC\xE2\x82\xAC\xF0\x9F\x94\xA7z";  // of 1, 2, 3, 4 and 1 bytes
  const std::size_t ends[] = {0, 1, 1, 3, 3, 3, 6, 6, 6, 6, 10, 11, 11};
  for (std::size_t bytes = 0; bytes < std::size(ends); ++bytes)
    EXPECT_EQ(first_letters(text, bytes), text.substr(0, ends[bytes])) << bytes;
  EXPECT_EQ(first_letters(std::string(20, '\x80'), 9).size(), 6u);  // no letters: the cut stays near
}

TEST(ConfigText, TheFlawHasItsLineAndColumn) {
  EXPECT_EQ(place_of_flaw("# \xC3\xBC\nname = \"M\xFChle\"\n"),
            "2:10: the byte 0xfc is no UTF-8; save the file as UTF-8");
  EXPECT_EQ(place_of_flaw("# \xC3\xBC\xFC"), "1:4: the byte 0xfc is no UTF-8; save the file as UTF-8");
  EXPECT_EQ(place_of_flaw(std::string_view("\xFF\xFE[\0m\0", 6)),
            "1:1: this text is UTF-16; save the file as UTF-8");
  EXPECT_EQ(place_of_flaw(std::string_view("\xFE\xFF\0[", 4)),
            "1:1: this text is UTF-16; save the file as UTF-8");
}

TEST(ConfigText, NumbersAsPeopleWriteThem) {
  EXPECT_EQ(explain_value("a = 1,5"), "'1,5' is no number; write 1.5, with a point");
  EXPECT_EQ(explain_value("a = -0,25  # mm"), "'-0,25' is no number; write -0.25, with a point");
  EXPECT_EQ(explain_value("a = 1,000"),
            "'1,000' is no number; write 1.000, with a point, or 1000 if the comma parts the thousands");
  EXPECT_EQ(explain_value("a = 0,001"), "'0,001' is no number; write 0.001, with a point");
  EXPECT_EQ(explain_value("a = 1,000.5"), "'1,000.5' is no number; write 1000.5, with a point");
  EXPECT_EQ(explain_value("a = 1.000,5"), "'1.000,5' is no number; write 1000.5, with a point");
  EXPECT_EQ(explain_value("a = 1,000,000"), "'1,000,000' is no number; write 1000000");
  EXPECT_EQ(explain_value("a = 1."), "write 1.0: a point has a digit on both sides");
  EXPECT_EQ(explain_value("a = -.5"), "write -0.5: a point has a digit on both sides");
  EXPECT_EQ(explain_value("a = 007"), "write 7, without zeros in front");
  EXPECT_EQ(explain_value("a = 1 000"), "'1 000' is no number; leave out the space in it");
  EXPECT_EQ(explain_value("a = 5 mm"), "write 5 without a unit; the key's name has it");
  EXPECT_EQ(explain_value("a = -5.5°"), "write -5.5 without a unit; the key's name has it");
}

TEST(ConfigText, TextsStandInStraightQuotes) {
  EXPECT_EQ(explain_value("name = X"), "a text stands in straight quotes: name = \"X\"");
  EXPECT_EQ(explain_value("name = “X”"), "a text stands in straight quotes, as name = \"...\"");
  EXPECT_EQ(explain_value("name = ‘X’"), "a text stands in straight quotes, as name = \"...\"");
  EXPECT_EQ(explain_value("name = X\""), "a text stands in straight quotes, as name = \"...\"");
  EXPECT_EQ(explain_value("enabled = True"), "write true, in small letters");
  EXPECT_EQ(explain_value("enabled = yes"), "write true or false");
}

// A guess that is wrong is worse than none. A key that stands there twice has a legal value, too.
TEST(ConfigText, WhatNobodyKnowsIsNotExplained) {
  for (const char* line :
       {"",         "a",           "a =",     "[a]",       "a = [1,5",       "a = {b = 1,5}", "a = \"x",
        "a = 0x1G", "\"a=b\" = X", "a = ?",   "# a = 1,5", "a = +",          "a = -",         "a = .",
        "a = ,5",   "a = 1.5",     "a = 0",   "a = 1e5",   "a = 1E-5",       "a = 0.5e+3",    "a = 1_000",
        "a = 0x10", "a = true",    "a = inf", "a = -nan",  "a = 1979-05-27", "a = 'x'"})
    EXPECT_EQ(explain_value(line), "") << line;
}

TEST(ConfigText, OneQuantityInTwoUnits) {
  EXPECT_TRUE(same_quantity("max_mm", "max_inch"));
  EXPECT_TRUE(same_quantity("velocity_mm_s", "velocity_inch_min"));
  EXPECT_TRUE(same_quantity("min_mm", "min"));
  EXPECT_FALSE(same_quantity("max_mm", "min_mm"));
  EXPECT_FALSE(same_quantity("max_mm", "max_mm"));
  EXPECT_FALSE(same_quantity("max_mm", "max_torque"));
}

}  // namespace
}  // namespace trn
