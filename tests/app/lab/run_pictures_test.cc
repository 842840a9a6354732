#include "app/lab/run_pictures.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "app/check/limit_judge.h"
#include "app/session/assembly.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kinematics/factory.h"
#include "tests/support/paths.h"

// The pictures of a run show what the run's own summary says.
namespace trn {
namespace {

std::string read(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

struct Drawn {
  SimulationResult result;
  std::vector<RunBin> bins;
};

Drawn drawn(const std::string& folder) {
  Assembly assembly = assemble(source_dir() + "/configs/cradle.toml");
  Parameters parameters;
  ToolTable tools = ToolTable::load(source_dir() + "/examples/tools.tbl");
  RunRecorder recorder(assembly.machine, *assembly.map);
  SimulationOptions options;
  options.program = source_dir() + "/examples/engraving.ngc";
  options.trace = &recorder;
  options.histograms = true;
  Drawn out{simulate(assembly, parameters, tools, options), recorder.bins()};
  write_run_pictures(folder, options.program, assembly.machine, out.bins, out.result);
  return out;
}

TEST(RunPictures, HoldWhatTheSummarySays) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "trn_run_pictures" / "new";
  std::filesystem::remove_all(folder.parent_path());
  const Drawn run = drawn(folder.string());
  ASSERT_LE(run.bins.size(), 6000u);
  double velocity = 0, jerk = 0;
  for (const RunBin& bin : run.bins) {
    velocity = std::max<double>(velocity, bin.velocity[0]);
    jerk = std::max<double>(jerk, bin.jerk[0]);
  }
  EXPECT_NEAR(velocity, run.result.joints[0].peak(Quantity::kVelocity).ratio, 1e-5);
  EXPECT_NEAR(jerk, run.result.joints[0].peak(Quantity::kJerk).ratio, 1e-5);
  std::uint64_t counted = 0;
  for (const std::uint64_t count : run.result.deviation.tip_histogram) counted += count;
  EXPECT_GT(counted, run.result.deviation.samples / 2);
  EXPECT_EQ(run.result.deviation.tip_histogram.back(), 0u) << "nothing beyond the tolerance";
  const std::string html = read(folder / "report.html");
  for (const char* name : {"speed", "joints", "path", "deviation"}) {
    const std::string svg = read(folder / (std::string(name) + ".svg"));
    EXPECT_EQ(svg.substr(0, 4), "<svg") << name;
    EXPECT_NE(html.find(svg), std::string::npos) << name;
  }
  for (const char* elsewhere : {"href=", "src=", "url("}) EXPECT_EQ(html.find(elsewhere), std::string::npos);
}

TEST(RunPictures, TellWhenTheyCannotBeWritten) {
  const Assembly assembly = assemble(source_dir() + "/configs/cradle.toml");
  EXPECT_THROW(write_run_pictures("/dev/null/x", "p.ngc", assembly.machine, {}, {}), std::runtime_error);
}

}  // namespace
}  // namespace trn
