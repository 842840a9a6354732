#include "core/config_text.h"

#include <gtest/gtest.h>

#include <string>

#include "core/config.h"

namespace trn {
namespace {

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

TEST(ConfigText, TablesAndKeysAreNamedOnce) {
  const auto said = [](const std::string& text) -> std::string {
    try {
      parse_config(text, "t.toml");
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(said("[a]\nb = 1\n[a]\nc = 2\n"),
            "t.toml:3:1: 'a' is there already; each table of a list stands as [[a]]");
  EXPECT_EQ(said("[[a]]\nb = 1\n[a]\nc = 2\n"),
            "t.toml:3:1: 'a' is there already; each table of a list stands as [[a]]");
  EXPECT_EQ(said("[a]\nb = 1\n[[a]]\nc = 2\n"),
            "t.toml:3:1: 'a' is there already; each table of a list stands as [[a]]");
  EXPECT_EQ(said("[a]\nb = 1\nb = 2\n"), "t.toml:3:5: 'b' is there already, further up in this table");
  for (const char* line : {"[a.b", "[[a.b]", "[a.b]]", "[[a.b", "[ a.b  # here"})
    EXPECT_NE(said(std::string(line) + "\nc = 1\n")
                  .find("a table is named in [ ], one of a list in [[ ]]: [a.b] or [[a.b]]"),
              std::string::npos)
        << said(std::string(line) + "\nc = 1\n");
  for (const char* text : {"a:\n  b: 1\n", "{\"a\": 1}\n", "a: 5\n"})
    EXPECT_NE(said(text).find("a config is TOML"), std::string::npos) << said(text);
  for (const char* line : {"[", "[[", "[]", "[[]]", "[ ", "[]]]"})
    EXPECT_NE(said(line).find("a table is named in [ ]"), std::string::npos) << said(line);
  for (const char* text : {"a = [\n  [1, x],\n]\n", "a = [\n  [1 2],\n  [\n", "a = \"b: c\n", "a = {b: 1}\n"})
    EXPECT_NE(said(text).find("Error while parsing"), std::string::npos) << said(text);
  EXPECT_EQ(said("[a]\nb = [1, 2]\n[[c]]\nd = {e = 1}\n"), "");
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
