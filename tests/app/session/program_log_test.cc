#include "app/session/program_log.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/simulation.h"
#include "core/config.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "tests/support/paths.h"

// What a program says and writes.
namespace trn {
namespace {

namespace fs = std::filesystem;
using What = canon::Log::What;

std::string content(const fs::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

class ProgramLogs : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  /// A program on the mill; what it said.
  std::vector<std::string> run(const std::string& program) {
    Assembly assembly = assemble(load_config(source_dir() + "/configs/mill.toml"));
    Parameters parameters;
    ToolTable tools;
    std::vector<std::string> said;
    ProgramLog log(folder_.string(), {});
    SimulationOptions options;
    options.program = "p.ngc";
    options.program_text = program;
    options.on_message = [&](std::string_view text, std::uint32_t line) {
      said.push_back(std::to_string(line) + ": " + std::string(text));
    };
    options.on_log = [&](const canon::Log& written, std::uint32_t line) { log.take(written, line); };
    simulate(assembly, parameters, tools, options);
    return said;
  }
  fs::path folder_;
};

TEST_F(ProgramLogs, LinesWithTheirValuesGoToTheFileOfTheFolder) {
  run("#1 = 2.5\n(LOG,nowhere)\n(LOGOPEN,a.csv)\n(LOG,x,#1)\n#1 = "
      "3\n(LOG,%dx,#1)\n(LOGCLOSE)\n(LOG,nowhere)\n"
      "(LOGAPPEND, a.csv)\n(LOG,more)\n(LOGOPEN,b)\nM2\n");
  EXPECT_EQ(content(folder_ / "a.csv"), "x,2.500000\nx,3\nmore\n");
  EXPECT_TRUE(fs::exists(folder_ / "b"));
  run("(LOGOPEN,a.csv)\n(LOG,new)\nM2\n");
  EXPECT_EQ(content(folder_ / "a.csv"), "new\n");
}

TEST_F(ProgramLogs, AProgramWritesNowhereElse) {
  for (const char* name : {"../a.csv", "/tmp/a.csv", ".profile", "sub/a.csv", "", "a b"}) {
    const std::string program = std::string("G0 X1\n(LOGOPEN,") + name + ")\nM2\n";
    try {
      run(program);
      ADD_FAILURE() << name;
    } catch (const ProgramError& error) {
      EXPECT_EQ(std::string(error.what()).substr(0, 8), "p.ngc:2:") << error.what();
    }
  }
  fs::create_directories(folder_);
  std::ofstream(folder_ / "other") << "kept";
  fs::create_symlink(folder_ / "other", folder_ / "link");
  EXPECT_THROW(run("(LOGOPEN,link)\n(LOG,x)\nM2\n"), ProgramError);
  EXPECT_EQ(content(folder_ / "other"), "kept");
}

TEST_F(ProgramLogs, WithoutAFolderNothingIsWrittenAndThatIsSaidOnce) {
  std::vector<std::string> warnings;
  ProgramLog log("", [&](const std::string& text) { warnings.push_back(text); });
  log.take({What::kOpen, "a.csv"}, 3);
  log.take({What::kLine, "x"}, 4);
  log.take({What::kOpen, "b.csv"}, 5);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].substr(0, 14), "line 3: a.csv ");
  EXPECT_FALSE(fs::exists("a.csv"));
}

TEST_F(ProgramLogs, MessagesAreHeardWithTheirLines) {
  const std::vector<std::string> said =
      run("#1 = 4\n(MSG,a #1)\n(PRINT,b #1)\n#5599 = 0\n(DEBUG,silent)\n#5599 = 1\n(DEBUG,c #1)\n(just a "
          "comment)\nM2\n");
  EXPECT_EQ(said, (std::vector<std::string>{"2: a #1", "3: b 4.000000", "7: c 4.000000"}));
}

}  // namespace
}  // namespace trn
