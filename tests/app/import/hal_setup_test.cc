#include "app/import/hal_setup.h"

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>

namespace trn {
namespace {

using HalFiles = std::map<std::string, std::string>;

ImportReader hal_reader(const HalFiles& files) {
  return [&files](const std::string& path) -> std::optional<std::string> {
    const auto found = files.find(path);
    return found == files.end() ? std::nullopt : std::optional(found->second);
  };
}

HalSetup hal_of(HalFiles files, const std::string& hal) {
  files["m.hal"] = hal;
  if (!files.contains("m.ini"))
    files["m.ini"] = "[HAL]\nHALFILE = m.hal\n[S]\nKEY = 2.5\nWORDS = trivkins coordinates=XZ\n";
  const ImportReader read = hal_reader(files);
  const IniFile ini = IniFile::load("m.ini", read);
  return HalSetup::load(ini, read, "/lib/");
}

std::string hal_error(const std::string& hal) {
  try {
    hal_of({}, hal);
  } catch (const ImportError& error) {
    return error.what();
  }
  return "no error";
}

TEST(HalSetup, PinsAreSetInThreeWays) {
  const HalSetup hal = hal_of({}, "setp a.x 1\na.y = 2\na.z=3\nsetp a.x 4 # the last one counts\n");
  EXPECT_EQ(hal.value_of("a.x")->text, "4");
  EXPECT_EQ(hal.value_of("a.y")->text, "2");
  EXPECT_EQ(hal.value_of("a.z")->text, "3");
  EXPECT_EQ(hal.value_of("a.x")->place.text(), "m.hal:4:10");
  EXPECT_FALSE(hal.value_of("b.x"));
}

TEST(HalSetup, SignalsCarryValuesAndDrivers) {
  const HalSetup hal = hal_of({},
                              "net one kins.offset gui.offset\nsets one 20\nnet two gui.pivot => kins.pivot\n"
                              "newsig three float\nlinksp three kins.late\nlinkps other.out three\n");
  EXPECT_EQ(hal.value_of("kins.offset")->text, "20");
  EXPECT_EQ(hal.value_of("kins.pivot")->text, "");
  EXPECT_EQ(hal.value_of("kins.pivot")->driver, "gui.pivot");
  EXPECT_EQ(hal.value_of("kins.late")->driver, "other.out");
  EXPECT_EQ(hal.signals_of("kins.").size(), 3u);
}

TEST(HalSetup, AnUnlinkedPinHasItsOwnValueAgain) {
  const HalSetup hal = hal_of({}, "setp k.x 7\nnet s k.x g.x\nunlinkp k.x\n");
  EXPECT_EQ(hal.value_of("k.x")->text, "7");
}

TEST(HalSetup, NamesOfTheIniAreItsValues) {
  const HalSetup hal = hal_of({}, "setp a.x [S]KEY\nsetp a.y [S](KEY)\nloadrt [S]WORDS\nsetp a.z [S]GONE\n");
  EXPECT_EQ(hal.value_of("a.x")->text, "2.5");
  EXPECT_EQ(hal.value_of("a.y")->text, "2.5");
  ASSERT_TRUE(hal.has_module("trivkins"));
  ASSERT_EQ(hal.modules()[0].arguments.size(), 1u);
  EXPECT_EQ(hal.modules()[0].arguments[0].text, "coordinates=XZ");
  ASSERT_EQ(hal.gaps().size(), 1u);
  EXPECT_EQ(hal.gaps()[0].what, "[S]GONE");
  EXPECT_EQ(hal.gaps()[0].place.text(), "m.hal:4:10");
}

TEST(HalSetup, FilesFromTheLibraryCommandsOfTheIniAndTcl) {
  const HalFiles files = {
      {"m.ini",
       "[HAL]\nHALFILE = m.hal\nHALFILE = LIB:a.hal\nHALFILE = b.hal\nHALFILE = c.tcl -x\n"
       "HALFILE = gone.hal\nHALCMD = setp d.x 4\n"},
      {"/lib/a.hal", "setp a.x 1\n"},
      {"/lib/b.hal", "setp b.x 2\nsource sub.hal\n"},
      {"sub.hal", "setp s.x 3\n"}};
  const HalSetup hal = hal_of(files, "# nothing\n");
  EXPECT_EQ(hal.value_of("a.x")->text, "1");
  EXPECT_EQ(hal.value_of("b.x")->text, "2");
  EXPECT_EQ(hal.value_of("s.x")->text, "3");
  EXPECT_EQ(hal.value_of("d.x")->place.text(), "m.ini:7:19");
  ASSERT_EQ(hal.gaps().size(), 2u);
  EXPECT_EQ(hal.gaps()[0].what, "c.tcl");
  EXPECT_EQ(hal.gaps()[1].what, "gone.hal");
  EXPECT_EQ(hal.gaps()[1].place.text(), "m.ini:6:11");
}

TEST(HalSetup, ErrorsHaveTheirPlace) {
  EXPECT_EQ(hal_error("setp a.x 1\n  setpp a.x 1\n"),
            "m.hal:2:3: 'setpp' is no command of HAL; did you mean 'setp'?");
  EXPECT_EQ(hal_error("setp a.x\n"),
            "m.hal:1:1: words are missing behind 'setp'; 'setp PIN VALUE' would be right");
  EXPECT_EQ(hal_error("setp a \"b\n"), "m.hal:1:8: this quotation mark is never closed");
  EXPECT_EQ(hal_error("a.x =\n"), "m.hal:1:1: a pin is set by 'setp PIN VALUE', or 'PIN = VALUE'");
  EXPECT_NE(hal_error("source m.hal\n").find("m.hal:1:8: files that source each other"), std::string::npos);
}

}  // namespace
}  // namespace trn
