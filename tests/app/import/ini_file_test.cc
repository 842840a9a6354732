#include "app/import/ini_file.h"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <optional>
#include <string>

namespace trn {
namespace {

using Files = std::map<std::string, std::string>;

ImportReader reader_of(const Files& files) {
  return [&files](const std::string& path) -> std::optional<std::string> {
    const auto found = files.find(path);
    return found == files.end() ? std::nullopt : std::optional(found->second);
  };
}

IniFile ini_of(const Files& files) { return IniFile::load("m.ini", reader_of(files)); }

std::string error_of(const Files& files) {
  try {
    ini_of(files);
  } catch (const ImportError& error) {
    return error.what();
  }
  return "no error";
}

TEST(IniFile, FirstOfAKeyCountsAndAllAreThere) {
  const IniFile ini = ini_of({{"m.ini", "[HAL]\nHALFILE = a.hal\nHALFILE=b.hal\n[TRAJ]\nHALFILE = c.hal\n"}});
  EXPECT_EQ(ini.find("HAL", "HALFILE")->value, "a.hal");
  ASSERT_EQ(ini.all("HAL", "HALFILE").size(), 2u);
  EXPECT_EQ(ini.all("HAL", "HALFILE")[1]->value, "b.hal");
  EXPECT_EQ(ini.find("HAL", "halfile"), nullptr);
}

TEST(IniFile, LinesGoOnBehindABackslash) {
  const IniFile ini = ini_of({{"m.ini", "[A]\nB = one \\\n   two\\\n three\nC = 4\n"}});
  EXPECT_EQ(ini.text("A", "B"), "one  two three");
  EXPECT_EQ(ini.find("A", "C")->key_place.text(), "m.ini:5:1");
}

TEST(IniFile, IncludedFilesCountWhereTheyStand) {
  const IniFile ini =
      ini_of({{"dir/axes.inc", "K = 2\n[B]\nL = 3\n"}, {"m.ini", "[A]\n#INCLUDE dir/axes.inc\nM = 4\n"}});
  EXPECT_EQ(ini.number("A", "K"), 2);
  EXPECT_EQ(ini.number("B", "L"), 3);
  EXPECT_EQ(ini.number("B", "M"), 4);
  EXPECT_EQ(ini.find("B", "L")->value_place.text(), "dir/axes.inc:3:5");
}

TEST(IniFile, AnIncludedFileIncludesNoOther) {
  const IniFile ini =
      ini_of({{"a.inc", "#INCLUDE m.ini\nK = 1\n"}, {"m.ini", "[A]\n#INCLUDE a.inc\n#INCLUDE\n#INCLUDED\n"}});
  EXPECT_EQ(ini.entries().size(), 1u);
  ASSERT_EQ(ini.gaps().size(), 2u);
  EXPECT_EQ(ini.gaps()[0].place.text(), "a.inc:1:1");
  EXPECT_EQ(ini.gaps()[1].place.text(), "m.ini:3:1");
}

TEST(IniFile, CommentsBlanksAndMarksOfTheLinesEnd) {
  const IniFile ini =
      ini_of({{"m.ini", "\xEF\xBB\xBF# one\r\n  ; two\r\n[A]\r\n  K = -2.5  # three\r\n L = a#b ; c\r\n"}});
  EXPECT_EQ(ini.number("A", "K"), -2.5);
  EXPECT_EQ(ini.text("A", "L"), "a#b");
}

TEST(IniFile, WhatNobodyAskedForIsLeft) {
  const IniFile ini = ini_of({{"m.ini", "[A]\nB = 1\nC = 2\n"}});
  ini.number("A", "B");
  EXPECT_TRUE(ini.entries()[0].used);
  EXPECT_FALSE(ini.entries()[1].used);
}

TEST(IniFile, ErrorsHaveTheirPlace) {
  const std::pair<const char*, const char*> cases[] = {
      {"[A\nB = 1\n", "m.ini:1:1: a section has its name"},
      {"[A]\n#INCLUDE gone.inc\n", "m.ini:2:1: the file 'gone.inc' cannot be read"},
      {"[]\n", "m.ini:1:2: '' is no name of a section"},
  };
  for (const auto& [text, begin] : cases)
    EXPECT_EQ(error_of({{"m.ini", text}}).substr(0, std::string(begin).size()), begin);
  EXPECT_EQ(error_of({{"m.ini", std::string("[A]\nB\0 = 1\n", 11)}}),
            "m.ini:2:2: a byte of 0: this file is no text");
}

TEST(IniFile, LinesThatLinuxcncSkipsAreLeftOutAndTold) {
  const IniFile ini = ini_of({{"m.ini", "Z = 1\n[A]\n  nonsense\nB = 1\n= 1\nSPEED 20\nfee$d = 3\nC = 2\n"}});
  EXPECT_EQ(ini.number("A", "B"), 1);
  EXPECT_EQ(ini.number("A", "C"), 2);
  EXPECT_EQ(ini.entries().size(), 2u);
  const std::array<std::array<std::string, 3>, 5> told = {
      {{"m.ini:1:1", "Z = 1", "before the first [SECTION]"},
       {"m.ini:3:3", "nonsense", "neither KEY = VALUE"},
       {"m.ini:5:1", "= 1", "no key has this name"},
       {"m.ini:6:1", "SPEED 20", "neither KEY = VALUE"},
       {"m.ini:7:1", "fee$d = 3", "no key has this name"}}};
  ASSERT_EQ(ini.gaps().size(), told.size());
  for (std::size_t i = 0; i < told.size(); ++i) {
    EXPECT_EQ(ini.gaps()[i].place.text(), told[i][0]);
    EXPECT_EQ(ini.gaps()[i].what, told[i][1]);
    EXPECT_NE(ini.gaps()[i].why.find(told[i][2]), std::string::npos) << ini.gaps()[i].why;
  }
}

TEST(IniFile, NumbersAreWholeOnes) {
  for (const char* text : {"12..5", "1e999", "nan", "inf", "", "0x10", "5 mm", "--2", "+-2"}) {
    const IniFile ini = ini_of({{"m.ini", "[A]\nKEY = " + std::string(text) + "\n"}});
    EXPECT_THROW(ini.number("A", "KEY"), ImportError) << text;
  }
  const IniFile ini = ini_of({{"m.ini", "[A]\nB = +1.5\nC = .5\nD = -3e2 ; old\n"}});
  EXPECT_EQ(ini.number("A", "B"), 1.5);
  EXPECT_EQ(ini.number("A", "C"), 0.5);
  EXPECT_EQ(ini.number("A", "D"), -300);
  EXPECT_EQ(ini.number("A", "E"), std::nullopt);
}

}  // namespace
}  // namespace trn
