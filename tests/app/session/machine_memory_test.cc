#include "app/session/machine_memory.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "interp/gcode/parameter_file.h"

namespace trn {
namespace {

namespace fs = std::filesystem;

class Memory : public testing::Test {
 protected:
  Memory() {
    std::string name = (fs::temp_directory_path() / "trn_memory_XXXXXX").string();
    folder = ::mkdtemp(name.data());
    files = {folder / "m.var", folder / "m.tbl"};
    std::ofstream(files.tools) << "T1 P1 Z+50 ;end mill\nT2 P2 Z+80\n";
    tools = ToolTable::load(files.tools);
    memory.emplace(parameters, tools, files);
  }
  ~Memory() override { fs::remove_all(folder); }
  double on_disk(int number) const {
    Parameters found;
    if (fs::exists(files.vars)) load_parameters(files.vars, found);
    return std::as_const(found)[number];
  }
  double length_on_disk(int tool) const { return ToolTable::load(files.tools).find(tool)->offset[2]; }

  fs::path folder;
  MemoryFiles files;
  Parameters parameters;
  ToolTable tools;
  std::optional<MachineMemory> memory;
};

TEST_F(Memory, KeepsOffsetsToolsAndTheUsersOwnParameters) {
  memory->keep(true);
  EXPECT_FALSE(fs::exists(files.vars)) << "nothing has changed";
  parameters[5221] = 12.5;
  memory->keep(false);
  EXPECT_EQ(on_disk(5221), 12.5);
  parameters[parameter::kTool] = 2;
  memory->keep(false);
  EXPECT_EQ(on_disk(parameter::kTool), 2);
  parameters[5000] = 7;
  memory->keep(true);
  EXPECT_EQ(on_disk(5000), 7);
  tools.at_or_new(1).offset[2] = 51.25;
  memory->keep(false);
  EXPECT_EQ(length_on_disk(1), 51.25);
  EXPECT_EQ(memory->tool_name(1), "tool 1 (end mill)");
  EXPECT_EQ(memory->tool_name(2), "tool 2");
  EXPECT_EQ(memory->tool_name(0), "no tool");
}

// Its line goes; that of a tool that somebody else has added to the file meanwhile stays, as do comments.
TEST_F(Memory, AToolThatIsTakenOutLeavesTheFile) {
  std::ofstream(files.tools) << "; the shop's\nT1 P1 Z+50 ;end mill\nT2 P2 Z+80\nT8 P8 Z+8\nnonsense\n";
  EXPECT_TRUE(tools.remove(2));
  EXPECT_FALSE(tools.remove(2));
  memory->keep(false);
  EXPECT_EQ(read_text_file(files.tools), "; the shop's\nT1 P1 Z+50 ;end mill\nT8 P8 Z+8\nnonsense\n");
  tools.at_or_new(2).pocket = 5;
  memory->keep(false);
  EXPECT_NE(read_text_file(files.tools).find("T2 P5\n"), std::string::npos) << "nothing of the old one";
}

// A loop that counts with #100 must not wait for the disk at every line.
TEST_F(Memory, CountingIsKeptInTheEndAndNotEveryTime) {
  int writes = 0;
  ino_t last = 0;
  for (int i = 1; i <= 1000; ++i) {
    parameters[100] = i;
    memory->keep(false);
    struct stat now {};
    if (::stat(files.vars.c_str(), &now) == 0 && now.st_ino != last) ++writes, last = now.st_ino;
  }
  EXPECT_LT(writes, 200);
  memory->keep(true);
  EXPECT_EQ(on_disk(100), 1000);
}

TEST_F(Memory, WhatCannotBeKeptIsTakenBack) {
  parameters[5221] = 1;
  parameters[31] = 2;
  memory->keep(true);
  ::chmod(files.vars.c_str(), 0444);
  ::chmod(files.tools.c_str(), 0444);
  parameters[5221] = 100;
  parameters[31] = 200;
  parameters[1] = 300;
  EXPECT_THROW(memory->keep(true), FileError);
  EXPECT_EQ(parameters[5221], 1);
  EXPECT_EQ(parameters[31], 2);
  EXPECT_EQ(parameters[1], 300) << "belongs to the program";
  tools.at_or_new(1).offset[2] = 99;
  EXPECT_THROW(memory->keep(true), FileError);
  EXPECT_EQ(tools.find(1)->offset[2], 50);
  EXPECT_NO_THROW(memory->keep(true)) << "nothing is left to keep";
  ::chmod(files.vars.c_str(), 0644);
  parameters[5221] = 100;
  memory->keep(false);
  EXPECT_EQ(on_disk(5221), 100);
}

TEST_F(Memory, WithoutFilesItOnlyRemembers) {
  MachineMemory plain(parameters, tools, {});
  parameters[5221] = 3;
  tools.at_or_new(1).comment = " ball";
  EXPECT_NO_THROW(plain.keep(true));
  EXPECT_EQ(plain.tool_name(1), "tool 1 (ball)");
}

}  // namespace
}  // namespace trn
