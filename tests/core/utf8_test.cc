#include "core/utf8.h"

#include <gtest/gtest.h>

#include <iterator>
#include <string>
#include <string_view>

namespace trn {
namespace {

std::string place_of_flaw(std::string_view text) {
  const auto flaw = find_encoding_flaw(text);
  return flaw ? std::to_string(flaw->line) + ":" + std::to_string(flaw->column) + ": " + flaw->why : "";
}

// Unicode 15, table 3-7: the least and the greatest of each length, and what lies between them.
TEST(Utf8, WhatIsUtf8AndWhatIsNot) {
  for (const char* good :
       {"", "plain\n", "\xC2\x80\xDF\xBF", "\xE0\xA0\x80\xED\x9F\xBF\xEE\x80\x80\xEF\xBF\xBF",
        "\xF0\x90\x80\x80\xF4\x8F\xBF\xBF"})
    EXPECT_EQ(place_of_flaw(good), "") << good;
  for (const char* bad : {"\x80", "\xC0\x80", "\xC1\xBF", "\xC2", "\xC2z", "\xE0\x9F\xBF", "\xED\xA0\x80",
                          "\xE2\x82", "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFF"})
    EXPECT_EQ(place_of_flaw(bad).substr(0, 5), "1:1: ") << bad;
}

TEST(Utf8, ACutTextKeepsWholeLetters) {
  const std::string text = "a\xC3\xBC\xE2\x82\xAC\xF0\x9F\x94\xA7z";  // of 1, 2, 3, 4 and 1 bytes
  const std::size_t ends[] = {0, 1, 1, 3, 3, 3, 6, 6, 6, 6, 10, 11, 11};
  for (std::size_t bytes = 0; bytes < std::size(ends); ++bytes)
    EXPECT_EQ(first_letters(text, bytes), text.substr(0, ends[bytes])) << bytes;
  EXPECT_EQ(first_letters(std::string(20, '\x80'), 9).size(), 6u);  // no letters: the cut stays near
}

TEST(Utf8, TheFlawHasItsLineAndColumn) {
  EXPECT_EQ(place_of_flaw("# \xC3\xBC\nname = \"M\xFChle\"\n"),
            "2:10: the byte 0xfc is no UTF-8; save the file as UTF-8");
  EXPECT_EQ(place_of_flaw("# \xC3\xBC\xFC"), "1:4: the byte 0xfc is no UTF-8; save the file as UTF-8");
  EXPECT_EQ(place_of_flaw(std::string_view("\xFF\xFE[\0m\0", 6)),
            "1:1: this text is UTF-16; save the file as UTF-8");
  EXPECT_EQ(place_of_flaw(std::string_view("\xFE\xFF\0[", 4)),
            "1:1: this text is UTF-16; save the file as UTF-8");
}

}  // namespace
}  // namespace trn
