#include "interp/gcode/text/lexer.h"

#include <gtest/gtest.h>

#include "interp/gcode/error.h"

namespace trn {
namespace {

TEST(Lexer, CaseAndWhiteSpaceDoNotMatter) {
  Lexer lexer(" G\t1 W h Ile");
  EXPECT_EQ(lexer.peek(), 'g');
  lexer.skip();
  EXPECT_EQ(lexer.integer(), 1);
  EXPECT_TRUE(lexer.accept_word("while"));
  EXPECT_EQ(lexer.peek(), '\0');
}

TEST(Lexer, AWordThatDoesNotComeConsumesNothing) {
  Lexer lexer("whimsy");
  EXPECT_FALSE(lexer.accept_word("while"));
  EXPECT_EQ(lexer.column(), 1U);
}

// The quick way through eight bytes and the way for all others read the same values.
TEST(Lexer, ShortNumbersAreExact) {
  for (const char* text : {"1", "-2.5", "+.125", "1234567", "12345.67", "0.001", "-999999999999.999"}) {
    for (const std::string& tail : {std::string(), std::string(" Y1      ")}) {
      const std::string line = text + tail;
      Lexer quick(line), any(line);
      double value = 0;
      ASSERT_TRUE(quick.short_number(value)) << line;
      EXPECT_EQ(value, std::stod(text)) << line;
      EXPECT_EQ(any.number(), value) << line;
    }
  }
}

TEST(Lexer, WhatIsNoShortNumberIsLeftAlone) {
  for (const char* text : {"[1+2]", "1 2 Y3", "12345678901234567890 ", "-"}) {
    Lexer lexer(text);
    double value = 0;
    EXPECT_FALSE(lexer.short_number(value)) << text;
    EXPECT_EQ(lexer.column(), 1U) << text;
  }
}

TEST(Lexer, CommentsEndAndDoNotNest) {
  Lexer good("a b) x");
  EXPECT_EQ(good.comment(), "a b");
  EXPECT_EQ(good.peek(), 'x');
  for (const char* text : {"open", "a (b) c)"}) EXPECT_THROW(Lexer(text).comment(), BlockError) << text;
}

}  // namespace
}  // namespace trn
