#include <filesystem>
#include <fstream>

#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "tests/interp/gcode/run_program.h"

// Parameter files and tool tables: what is read, what is refused, what is written.
namespace trn {
namespace {

std::string parameter_error(const std::string& text) {
  Parameters parameters;
  try {
    parse_parameters(text, "v.var", parameters);
  } catch (const ProgramError& error) {
    return error.what();
  }
  return {};
}

std::string tool_error(const std::string& text) {
  try {
    ToolTable::parse(text, "t.tbl");
  } catch (const ProgramError& error) {
    return error.what();
  }
  return {};
}

TEST(Tables, ParameterFilesAreReadAsTheyStand) {
  Parameters parameters;
  parse_parameters("; a comment\r\n\n  31   1.5e2\r\n5220\t2\r\n5221 -0.25", "v.var", parameters);
  EXPECT_EQ(parameters[31], 150);
  EXPECT_EQ(parameters[5220], 2);
  EXPECT_EQ(parameters[5221], -0.25);
  parse_parameters("5220 12\n", "v.var", parameters);
  EXPECT_EQ(parameters[5220], 1) << "there is no such coordinate system";
}

TEST(Tables, ParameterFilesThatAreNoneAreRefused) {
  EXPECT_EQ(parameter_error("abc 1\n"), "v.var:1:1: not a number");
  EXPECT_EQ(parameter_error("31\n"), "v.var:1:3: not a number");
  EXPECT_EQ(parameter_error("31 x\n"), "v.var:1:3: not a number");
  EXPECT_EQ(parameter_error("31 1 ; mine\n"), "v.var:1:3: not a number");
  EXPECT_EQ(parameter_error("31 1 2\n"), "v.var:1:3: not a number");
  for (const char* value : {"inf", "-INFINITY", "nan", "1e999"})
    EXPECT_EQ(parameter_error(std::string("31 ") + value + "\n"), "v.var:1:3: not a number") << value;
  EXPECT_EQ(parameter_error("0 1\n"), "v.var:1:1: there is no parameter number 0");
  EXPECT_EQ(parameter_error("31 1\n31 2\n"), "v.var:2:1: the word 31 is given twice");
  EXPECT_EQ(parameter_error("32 1\n31 2\n"), "v.var:2:1: the word 31 is given twice");
}

TEST(Tables, FilesWithZerosAreNoText) {
  const std::string zeros(100, '\0');
  EXPECT_EQ(parameter_error(zeros), "v.var:1:1: byte 0x00 is not text");
  EXPECT_EQ(parameter_error("31 1\n32 1" + zeros), "v.var:2:5: byte 0x00 is not text");
  EXPECT_EQ(tool_error(zeros), "t.tbl:1:1: byte 0x00 is not text");
  EXPECT_EQ(tool_error("T1 P1\nT2 P2" + zeros + " Z50\n"), "t.tbl:2:6: byte 0x00 is not text");
}

TEST(Tables, FilesAreReplacedInOneStep) {
  const std::string path = testing::TempDir() + "tables_test.var";
  Parameters one;
  one[100] = 2.5;
  one[5] = 7;
  save_parameters(path, one);
  EXPECT_FALSE(std::filesystem::exists(path + ".new"));
  Parameters two;
  load_parameters(path, two);
  EXPECT_EQ(two[100], 2.5);
  EXPECT_EQ(two[5], 0) << "locals are not kept";
  std::ofstream(path).flush();
  EXPECT_EQ(read_text_file(path), "");
  EXPECT_THROW(load_parameters("/no/such/file.var", two), ProgramError);
  EXPECT_THROW(save_parameters("/no/such/file.var", two), ProgramError);
  const std::string folder = testing::TempDir() + "tables_test.folder";
  std::filesystem::create_directories(folder + "/inside");
  EXPECT_THROW(save_parameters(folder, two), ProgramError) << "a folder is in the way";
  std::filesystem::remove(folder + ".new");
}

// A folder was an empty table once, and a pipe was waited for.
TEST(Tables, ATableIsARegularFile) {
  const auto why = [](const std::string& path) {
    try {
      ToolTable::load(path, 1);
    } catch (const ProgramError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(why(testing::TempDir()), testing::TempDir() + ":1:1: this is a folder; name a file in it");
  EXPECT_EQ(why("/dev/zero"), "/dev/zero:1:1: this is no regular file but a device; name a file on a disk");
  EXPECT_EQ(why("none.tbl"), "none.tbl:1:1: cannot read this file: No such file or directory");
  Parameters parameters;
  EXPECT_THROW(load_parameters(testing::TempDir(), parameters), ProgramError);
  EXPECT_THROW(load_parameters("/dev/zero", parameters), ProgramError);
}

TEST(Tables, ToolTablesHaveEveryField) {
  const ToolTable table = ToolTable::parse(
      "; tools\r\nt1 p2 x1 y2 z3 a4 b5 c6 u7 v8 w9 d10 i11 j12 q3 ; all of it\r\n", "t.tbl", 2);
  const Tool* tool = table.find(1);
  ASSERT_NE(tool, nullptr);
  EXPECT_EQ(tool->pocket, 2);
  EXPECT_EQ(tool->offset[kX], 2) << "lengths in units of 2 mm";
  EXPECT_EQ(tool->offset[kC], 6) << "angles are degrees";
  EXPECT_EQ(tool->diameter, 20);
  EXPECT_EQ(tool->front_deg, 11);
  EXPECT_EQ(tool->back_deg, 12);
  EXPECT_EQ(tool->orientation, 3);
  EXPECT_EQ(table.find(2), nullptr);
  const ToolTable again = ToolTable::parse(table.to_text(), "t.tbl");
  EXPECT_EQ(again.to_text(), table.to_text());
}

TEST(Tables, AToolsSizesAreReadAgainAsTheyWere) {
  for (const char* size :
       {"0.040048071202438655", "-0.000000000000000000123456789", "+123.456789012345678"}) {
    const ToolTable table = ToolTable::parse(std::string("T1 P1 Z") + size, "t.tbl");
    const ToolTable again = ToolTable::parse(table.to_text(), "t.tbl");
    EXPECT_EQ(again.find(1)->offset[kZ], table.find(1)->offset[kZ]) << table.to_text();
  }
  EXPECT_EQ(ToolTable::parse("T1 P1 Z50 D0.5", "t.tbl").to_text(), "T1 P1 Z+50.000000 D+0.500000\n");
  EXPECT_EQ(ToolTable::parse("T1 P1 Z0.1234567 D-0.1234567", "t.tbl").to_text(),
            "T1 P1 Z+0.1234567 D-0.1234567\n")
      << "with its sign, as those of six digits";
}

TEST(Tables, ToolTablesThatAreNoneAreRefused) {
  EXPECT_EQ(tool_error("T1 P1\nT1 P2\n"), "t.tbl:2:1: the word T1 is given twice");
  EXPECT_EQ(tool_error("P1 Z5\n"), "t.tbl:1:1: a tool needs T and its number");
  EXPECT_EQ(tool_error("T1.5\n"), "t.tbl:1:1: the tool or pocket number = 1.5 is not an integer");
  EXPECT_EQ(tool_error("T-1\n"), "t.tbl:1:1: the tool or pocket number = -1 is not an integer");
  EXPECT_EQ(tool_error("T1 K5\n").substr(0, 33), "t.tbl:1:4: unexpected character '");
  EXPECT_EQ(tool_error("T1 Z\n"), "t.tbl:1:5: not a number");
  EXPECT_EQ(
      tool_error("# a config\n[machine]\nperiod_s = 0.001\n"),
      "t.tbl:3:2: not a number; this looks like no tool table; a tool is a line as 'T1 P1 Z50.5 D6 ;end "
      "mill'");
  EXPECT_THROW(ToolTable::load("/no/such/tools.tbl"), ProgramError);
}

}  // namespace
}  // namespace trn
